// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "understory/sim/trunk_index.hpp"

namespace understory {
namespace {

// Candidates are constructed this much farther out, so that rounding cannot cost the clearance.
constexpr double kSlackM = 1e-6;

bool touches(const TriangleMesh& mesh,
             const std::array<std::uint32_t, 3>& triangle,
             const Box2d& rectangle_m) {
  Box2d bounds;
  for (const std::uint32_t vertex : triangle) {
    bounds.extend(Vector2d(mesh.vertices_m[vertex].head<2>().cast<double>()));
  }
  return bounds.intersects(rectangle_m);
}

// A trunk grown by the clearance: the point has to stay outside of it.
struct Keepout {
  Vector2d center_m;
  double radius_m;
};

void add_crossings(const Keepout& a, const Keepout& b, std::vector<Vector2d>& out) {
  const Vector2d between = b.center_m - a.center_m;
  const double distance = between.norm();
  if (distance == 0.0 || distance > a.radius_m + b.radius_m ||
      distance < std::abs(a.radius_m - b.radius_m)) {
    return;
  }
  const double along =
      (distance * distance + a.radius_m * a.radius_m - b.radius_m * b.radius_m) / (2.0 * distance);
  const double across = std::sqrt(std::max(0.0, a.radius_m * a.radius_m - along * along));
  const Vector2d forward = between / distance;
  const Vector2d sideways(-forward.y(), forward.x());
  out.emplace_back(a.center_m + along * forward + across * sideways);
  out.emplace_back(a.center_m + along * forward - across * sideways);
}

void add_side_crossings(const Keepout& keepout, const Box2d& inner, std::vector<Vector2d>& out) {
  for (int axis = 0; axis < 2; ++axis) {
    for (const double side : {inner.min()[axis], inner.max()[axis]}) {
      const double offset = side - keepout.center_m[axis];
      if (std::abs(offset) > keepout.radius_m) {
        continue;
      }
      const double across = std::sqrt(keepout.radius_m * keepout.radius_m - offset * offset);
      for (const double sign : {-1.0, 1.0}) {
        Vector2d point = keepout.center_m;
        point[axis] = side;
        point[1 - axis] += sign * across;
        out.push_back(point);
      }
    }
  }
}

// The nearest point of a rectangle minus discs is one of: the nearest point of the rectangle, the
// nearest point of a circle, or where two circles, a circle and a side, or two sides meet.
std::vector<Vector2d> candidates(const std::vector<Trunk>& trunks,
                                 const Box2d& inner,
                                 const Vector2d& near_m,
                                 double clearance_m) {
  std::vector<Keepout> keepouts;
  std::vector<Trunk> grown;
  for (const Trunk& trunk : trunks) {
    keepouts.push_back({trunk.center_m, trunk.radius_m + clearance_m + kSlackM});
    grown.push_back({trunk.center_m, keepouts.back().radius_m});
  }
  std::vector<Vector2d> points;
  points.emplace_back(near_m.cwiseMax(inner.min()).cwiseMin(inner.max()));
  for (const auto corner :
       {Box2d::BottomLeft, Box2d::BottomRight, Box2d::TopLeft, Box2d::TopRight}) {
    points.emplace_back(inner.corner(corner));
  }
  const TrunkIndex index(grown);
  for (std::size_t i = 0; i < keepouts.size(); ++i) {
    const Keepout& keepout = keepouts[i];
    const Vector2d away = near_m - keepout.center_m;
    const double distance = away.norm();
    points.emplace_back(keepout.center_m +
                        keepout.radius_m *
                            (distance > 0.0 ? Vector2d(away / distance) : Vector2d(1.0, 0.0)));
    add_side_crossings(keepout, inner, points);
    const Vector2d reach = Vector2d::Constant(keepout.radius_m);
    for (const std::size_t j :
         index.touching({keepout.center_m - reach, keepout.center_m + reach})) {
      if (j > i) {
        add_crossings(keepout, keepouts[j], points);
      }
    }
  }
  return points;
}

}  // namespace

Forest crop(const Forest& forest, const Box2d& rectangle_m) {
  Forest kept;
  kept.trunk_height_m = forest.trunk_height_m;
  for (const Trunk& trunk : forest.trunks) {
    if (rectangle_m.squaredExteriorDistance(trunk.center_m) <= trunk.radius_m * trunk.radius_m) {
      kept.trunks.push_back(trunk);
    }
  }
  for (const TriangleMesh& mesh : forest.meshes) {
    TriangleMesh part{mesh.vertices_m, {}};
    for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
      if (touches(mesh, triangle, rectangle_m)) {
        part.triangles.push_back(triangle);
      }
    }
    if (!part.triangles.empty()) {
      kept.meshes.push_back(std::move(part));
    }
  }
  return kept;
}

Forest shifted(const Forest& forest, const Vector2d& offset_m) {
  Forest moved = forest;
  for (Trunk& trunk : moved.trunks) {
    trunk.center_m += offset_m;
  }
  for (TriangleMesh& mesh : moved.meshes) {
    for (Eigen::Vector3f& vertex : mesh.vertices_m) {
      vertex.head<2>() = (vertex.head<2>().cast<double>() + offset_m).cast<float>();
    }
  }
  return moved;
}

Forest centered_crop(const Forest& forest, const Box2d& rectangle_m) {
  return shifted(crop(forest, rectangle_m), -rectangle_m.center());
}

std::optional<Vector2d> nearest_clear_point(const Forest& forest,
                                            const Box2d& box_m,
                                            const Vector2d& near_m,
                                            double clearance_m) {
  assert(clearance_m >= 0.0);
  const Vector2d margin = Vector2d::Constant(clearance_m);
  const Box2d inner(box_m.min() + margin, box_m.max() - margin);
  if (inner.isEmpty()) {
    return std::nullopt;
  }
  std::vector<Vector2d> points = candidates(forest.trunks, inner, near_m, clearance_m);
  std::stable_sort(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
    return (a - near_m).squaredNorm() < (b - near_m).squaredNorm();
  });
  const TrunkIndex index(forest.trunks);
  for (const Vector2d& point : points) {
    if (inner.contains(point) && index.distance_m(point, clearance_m) >= clearance_m) {
      return point;
    }
  }
  return std::nullopt;
}

}  // namespace understory
