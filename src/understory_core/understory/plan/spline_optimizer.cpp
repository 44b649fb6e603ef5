// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/spline_optimizer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>

#include <nlopt.h>

namespace understory {
namespace {

constexpr double kJerkWeight = 2e-4;
constexpr double kPreferenceWeight = 1.0;
constexpr double kFirstStep_m = 0.1;  // all control points together
constexpr std::size_t kFixed = 3;     // control points at each end

// The cost as a function of (inner control points, log of knot_s) and its gradient.
class SplineCost {
 public:
  SplineCost(const ClearanceMap& map,
             const SplineTask& task,
             const CubicBSpline<Vector3d>& initial,
             const OptimizerEffort& effort)
      : map_(map),
        task_(task),
        effort_(effort),
        points_(initial.control_points),
        point_gradient_(points_.size()),
        velocity_(points_.size() - 1),
        velocity_gradient_(points_.size() - 1),
        acceleration_(points_.size() - 2),
        acceleration_gradient_(points_.size() - 2) {}

  [[nodiscard]] std::size_t variables() const { return 3 * inner() + 1; }

  [[nodiscard]] std::vector<double> variables_of(const CubicBSpline<Vector3d>& spline) const {
    std::vector<double> x(variables());
    for (std::size_t i = 0; i < inner(); ++i) {
      Eigen::Map<Vector3d>{&x[3 * i]} = spline.control_points[kFixed + i];
    }
    x.back() = std::log(spline.knot_s);
    return x;
  }

  [[nodiscard]] double evaluate(const double* x, double* gradient) {
    unpack(x);
    std::fill(point_gradient_.begin(), point_gradient_.end(), Vector3d::Zero());
    knot_gradient_ = 0.0;
    double cost = 0.0;
    if (effort_.duration_is_free) {
      const double pieces = static_cast<double>(points_.size() - 3);
      cost += pieces * knot_s_;
      knot_gradient_ += pieces;
    }
    cost += add_motion_cost();
    cost += add_clearance_cost();
    if (gradient != nullptr) {
      pack_gradient(gradient);
      scale_to_first_step(gradient);
    }
    if (cost < lowest_cost_) {
      lowest_cost_ = cost;
      best_.assign(x, x + variables());
    }
    return scale_ * cost;
  }

  // Of all evaluations; when the solver stops it may stand elsewhere.
  [[nodiscard]] CubicBSpline<Vector3d> best_spline() {
    unpack(best_.data());
    return {points_, knot_s_};
  }

 private:
  [[nodiscard]] std::size_t inner() const { return points_.size() - 2 * kFixed; }

  void unpack(const double* x) {
    for (std::size_t i = 0; i < inner(); ++i) {
      points_[kFixed + i] = Eigen::Map<const Vector3d>(&x[3 * i]);
    }
    if (effort_.duration_is_free || knot_s_ == 0.0) {
      knot_s_ = std::exp(x[3 * inner()]);
      const std::array<Vector3d, 3> first = control_points_for<Vector3d>(task_.start, knot_s_);
      std::copy(first.begin(), first.end(), points_.begin());
    }
  }

  void pack_gradient(double* gradient) const {
    for (std::size_t i = 0; i < inner(); ++i) {
      Eigen::Map<Vector3d>{&gradient[3 * i]} = point_gradient_[kFixed + i];
    }
    if (!effort_.duration_is_free) {
      gradient[3 * inner()] = 0.0;
      return;
    }
    // The first three control points follow the knot spacing (control_points_for).
    const Vector3d& v = task_.start.first;
    const Vector3d bend = task_.start.second * (knot_s_ / 3.0);
    const double through_start = point_gradient_[0].dot(-v + 2.0 * bend) -
                                 point_gradient_[1].dot(bend) +
                                 point_gradient_[2].dot(v + 2.0 * bend);
    gradient[3 * inner()] = (knot_gradient_ + through_start) * knot_s_;
  }

  // The solver's first trial step is the gradient itself; it gives up when that is far too long.
  void scale_to_first_step(double* gradient) {
    Eigen::Map<Eigen::VectorXd> scaled{gradient, static_cast<Eigen::Index>(variables())};
    if (scale_ == 0.0) {
      scale_ = kFirstStep_m / std::max(1e-9, scaled.norm());
    }
    scaled *= scale_;
  }

  // (|x|^2 / limit^2 - 1)^2 where positive, times the knot spacing.
  double add_limit_cost(const Vector3d& x, double limit, Vector3d& x_gradient) {
    const double excess = x.squaredNorm() / (limit * limit) - 1.0;
    if (excess <= 0.0) {
      return 0.0;
    }
    const double weight = effort_.limit_weight;
    x_gradient += (4.0 * weight * knot_s_ * excess / (limit * limit)) * x;
    knot_gradient_ += weight * excess * excess;
    return weight * knot_s_ * excess * excess;
  }

  double add_motion_cost() {
    const std::size_t n = points_.size();
    const double rate = 1.0 / knot_s_;
    double cost = 0.0;
    for (std::size_t i = 0; i + 1 < n; ++i) {
      velocity_[i] = (points_[i + 1] - points_[i]) * rate;
      velocity_gradient_[i].setZero();
    }
    for (std::size_t i = 0; i + 2 < n; ++i) {
      acceleration_[i] = (velocity_[i + 1] - velocity_[i]) * rate;
      acceleration_gradient_[i].setZero();
    }
    // Where the start's state decides, a penalty could only push the time.
    for (std::size_t i = 2; i + 1 < n; ++i) {
      cost += add_limit_cost(velocity_[i], task_.limits.speed_mps, velocity_gradient_[i]);
    }
    for (std::size_t i = 1; i + 2 < n; ++i) {
      cost += add_limit_cost(
          acceleration_[i], task_.limits.acceleration_mps2, acceleration_gradient_[i]);
    }
    for (std::size_t i = 0; i + 3 < n; ++i) {
      const Vector3d jerk = (acceleration_[i + 1] - acceleration_[i]) * rate;
      cost += kJerkWeight * knot_s_ * jerk.squaredNorm();
      const Vector3d jerk_gradient = (2.0 * kJerkWeight * knot_s_) * jerk;
      knot_gradient_ += kJerkWeight * jerk.squaredNorm() - jerk_gradient.dot(jerk) * rate;
      acceleration_gradient_[i + 1] += jerk_gradient * rate;
      acceleration_gradient_[i] -= jerk_gradient * rate;
    }
    back_propagate(rate);
    return cost;
  }

  void back_propagate(double rate) {
    for (std::size_t i = 0; i < acceleration_.size(); ++i) {
      const Vector3d g = acceleration_gradient_[i] * rate;
      knot_gradient_ -= g.dot(acceleration_[i]);
      velocity_gradient_[i + 1] += g;
      velocity_gradient_[i] -= g;
    }
    for (std::size_t i = 0; i < velocity_.size(); ++i) {
      const Vector3d g = velocity_gradient_[i] * rate;
      knot_gradient_ -= g.dot(velocity_[i]);
      point_gradient_[i + 1] += g;
      point_gradient_[i] -= g;
    }
  }

  double add_clearance_cost() {
    double cost = 0.0;
    for (std::size_t i = 0; i + 3 < points_.size(); ++i) {
      cost += add_clearance_cost_at(i, {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0});
      cost += add_clearance_cost_at(i, {1.0 / 48.0, 23.0 / 48.0, 23.0 / 48.0, 1.0 / 48.0});
    }
    return cost;
  }

  double add_clearance_cost_at(std::size_t first, const std::array<double, 4>& basis) {
    Vector3d point = Vector3d::Zero();
    for (std::size_t k = 0; k < basis.size(); ++k) {
      point += basis[k] * points_[first + k];
    }
    const DistanceAndGradient found = map_.distance_and_gradient(point);
    const double wanting = task_.preferred_clearance_m - found.distance_m;
    if (wanting <= 0.0) {
      return 0.0;
    }
    const double missing = std::max(0.0, task_.least_clearance_m - found.distance_m);
    const double weight = effort_.clearance_weight;
    const double density = weight * missing * missing + kPreferenceWeight * wanting * wanting;
    const double slope = -2.0 * (weight * missing + kPreferenceWeight * wanting);
    knot_gradient_ += density;
    const Vector3d gradient = (slope * knot_s_) * found.gradient;
    for (std::size_t k = 0; k < basis.size(); ++k) {
      point_gradient_[first + k] += basis[k] * gradient;
    }
    return knot_s_ * density;
  }

  const ClearanceMap& map_;
  const SplineTask& task_;
  const OptimizerEffort& effort_;
  double lowest_cost_ = std::numeric_limits<double>::infinity();
  std::vector<double> best_;
  double scale_ = 0.0;
  double knot_s_ = 0.0;
  double knot_gradient_ = 0.0;
  std::vector<Vector3d> points_;
  std::vector<Vector3d> point_gradient_;
  std::vector<Vector3d> velocity_;
  std::vector<Vector3d> velocity_gradient_;
  std::vector<Vector3d> acceleration_;
  std::vector<Vector3d> acceleration_gradient_;
};

double evaluate_for_nlopt(unsigned /*n*/, const double* x, double* gradient, void* cost) {
  return static_cast<SplineCost*>(cost)->evaluate(x, gradient);
}

}  // namespace

CubicBSpline<Vector3d> optimized_spline(const ClearanceMap& map,
                                        const SplineTask& task,
                                        const CubicBSpline<Vector3d>& initial,
                                        const OptimizerEffort& effort) {
  assert(initial.control_points.size() > 2 * kFixed);
  SplineCost cost(map, task, initial, effort);
  std::vector<double> x = cost.variables_of(initial);
  // NLopt's C interface: failures are return codes, the C++ one throws.
  const std::unique_ptr<nlopt_opt_s, decltype(&nlopt_destroy)> solver(
      nlopt_create(NLOPT_LD_LBFGS, static_cast<unsigned>(x.size())), &nlopt_destroy);
  nlopt_set_min_objective(solver.get(), &evaluate_for_nlopt, &cost);
  nlopt_set_maxeval(solver.get(), effort.evaluations);
  nlopt_set_ftol_rel(solver.get(), 1e-5);
  nlopt_set_vector_storage(solver.get(), 12);
  double cost_at_end = 0.0;
  (void)nlopt_optimize(solver.get(), x.data(), &cost_at_end);
  return cost.best_spline();
}

CubicBSpline<Vector3d> refined_spline(const CubicBSpline<Vector3d>& spline) {
  const std::vector<Vector3d>& q = spline.control_points;
  CubicBSpline<Vector3d> refined;
  refined.knot_s = 0.5 * spline.knot_s;
  refined.control_points.reserve(2 * q.size() - 3);
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    if (i > 0) {
      refined.control_points.emplace_back((q[i - 1] + 6.0 * q[i] + q[i + 1]) / 8.0);
    }
    refined.control_points.emplace_back(0.5 * (q[i] + q[i + 1]));
  }
  return refined;
}

}  // namespace understory
