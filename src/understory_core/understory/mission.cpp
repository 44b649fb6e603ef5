// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/mission.hpp"

#include <algorithm>
#include <limits>

#include "understory/team/coordination.hpp"

namespace understory {
namespace {

constexpr int kStrikesPerFailure = 6;
constexpr int kMaxStrikes = 20 * kStrikesPerFailure;
constexpr int kMaxResumptions = 3;
// In a tight place one map update may block every route, and the next one open it.
constexpr double kConfirmNothingLeftS = 2.0;
constexpr double kArrivedM = 0.25;
constexpr double kRetryIntervalS = 0.5;
constexpr double kHeadroomM = 0.5;

// Who is in the way may go away by itself: that is tried for longer.
int strikes_of(PlanError error) {
  return error == PlanError::kTraffic ? 1 : kStrikesPerFailure;
}

}  // namespace

Box3d launch_site_m(const MissionConfig& config, const Vector3d& home_m) {
  const double radius_m = config.launch_site_radius_m;
  const double top_m = std::max(config.take_off_height_m, home_m.z()) + kHeadroomM;
  return {home_m - Vector3d(radius_m, radius_m, home_m.z()),
          Vector3d(home_m.x() + radius_m, home_m.y() + radius_m, top_m)};
}

// NOLINTNEXTLINE(readability-function-size): all that a mission starts from, once
Mission::Mission(const MissionConfig& config,
                 const ExplorerConfig& explorer,
                 const GridGeometry& geometry,
                 const Vector3d& home_m,
                 double yaw_rad,
                 Time now)
    : config_(config),
      explorer_config_(explorer),
      pilot_(explorer.plan, duration_from_seconds(explorer.replan.lead_s)),
      explorer_(explorer, geometry),
      meeting_(explorer.team.coordination),
      lookout_(explorer.team),
      home_m_(home_m),
      home_yaw_rad_(yaw_rad),
      state_(config.auto_start ? MissionState::kTakeOff : MissionState::kWaiting),
      started_at_(now) {
  if (!geometry.box_m().contains(home_m)) {
    throw ConfigError("start: lies outside the exploration box");
  }
  pilot_.take_position(home_m, yaw_rad, now);
}

void Mission::end_exploration(StopReason reason, Time now) {
  reason_ = reason;
  if (has_explored_) {
    explored_at_ = nothing_left_since_.value_or(now);
    has_explored_ = false;
  }
  nothing_left_since_.reset();
  state_ = config_.return_home && reason == StopReason::kNothingLeft ? MissionState::kReturnHome
                                                                     : MissionState::kStopped;
}

// Null where the vehicle rests, or where there is no braking trajectory: then the flown one stands,
// which ends at rest as well.
TrajectoryPtr Mission::brake(Time now) {
  if (!has_map_ || pilot_.is_at_rest(now)) {
    return nullptr;
  }
  const Result<TrajectoryPtr, PlanError> braked = pilot_.brake(now);
  return braked ? *braked : nullptr;
}

TrajectoryPtr Mission::stop(StopReason reason, Time now) {
  if (is_over()) {
    return nullptr;
  }
  TrajectoryPtr braking = brake(now);
  if (reason_ == StopReason::kNone) {
    end_exploration(reason, now);
  }
  state_ = MissionState::kStopped;
  return braking;
}

bool Mission::start(Time now) {
  if (state_ == MissionState::kWaiting) {
    started_at_ = now;
    state_ = MissionState::kTakeOff;
    return true;
  }
  if (state_ == MissionState::kPaused) {
    state_ = resumed_state_;
    return true;
  }
  return false;
}

Mission::Answer Mission::pause(Time now) {
  const bool is_pausable = state_ == MissionState::kTakeOff || state_ == MissionState::kExplore ||
                           state_ == MissionState::kReturnHome ||
                           state_ == MissionState::kDescend || state_ == MissionState::kMeet;
  if (!is_pausable) {
    return {};
  }
  resumed_state_ = state_;
  state_ = MissionState::kPaused;
  return {true, brake(now)};
}

Mission::Answer Mission::return_home(Time now) {
  if (is_over() || state_ == MissionState::kWaiting) {
    return {};
  }
  if (reason_ == StopReason::kNone) {
    end_exploration(StopReason::kReturnRequested, now);
  }
  resumptions_ = kMaxResumptions;  // whoever asks for the way home wants no more exploring
  strikes_ = 0;
  state_ = MissionState::kReturnHome;
  return {true, nullptr};  // the way home begins on what is flown
}

Mission::Answer Mission::land(Time now) {
  if (is_over() || state_ == MissionState::kWaiting) {
    return {};
  }
  if (reason_ == StopReason::kNone) {
    end_exploration(StopReason::kLandRequested, now);
  }
  strikes_ = 0;
  state_ = MissionState::kDescend;
  return {true, brake(now)};
}

void Mission::withdraw(const TrajectoryPtr& trajectory) {
  pilot_.withdraw(trajectory);
}

// In these states nobody else checks what is being flown against the newest map.
bool Mission::is_flying_unwatched() const {
  return state_ != MissionState::kExplore && state_ != MissionState::kReturnHome &&
         state_ != MissionState::kMeet;
}

// Straight there; null and counted when there is no checked trajectory.
TrajectoryPtr Mission::fly_leg(const Vector3d& to_m, Time now) {
  last_leg_ = now;
  const Result<TrajectoryPtr, PlanError> flown =
      pilot_.fly({{pilot_.next_start_point(now).position_m, to_m},
                  pilot_.next_start_point(now).yaw_rad,
                  FlightMode::kTransit,
                  explorer_config_.limits.limits_for(FlightMode::kExplorer)},
                 now);
  strikes_ = flown ? 0 : strikes_ + strikes_of(flown.error());
  return flown ? *flown : nullptr;
}

TrajectoryPtr Mission::climb(Time now) {
  if (!pilot_.is_at_rest(now) || to_seconds(now - last_leg_) < kRetryIntervalS) {
    return nullptr;
  }
  const Vector3d here = pilot_.next_start_point(now).position_m;
  if (here.z() > config_.take_off_height_m - kArrivedM) {
    state_ = MissionState::kExplore;
    return nullptr;
  }
  TrajectoryPtr leg = fly_leg({here.x(), here.y(), config_.take_off_height_m}, now);
  if (strikes_ >= kMaxStrikes) {
    end_exploration(StopReason::kTakeOffFailed, now);
  }
  return leg;
}

// "Nothing left" counts once it has been so for a while, if there are clusters that it may be wrong
// about.
TrajectoryPtr Mission::explore(const ExploreStep& step, Time now) {
  if (step.status != ExploreStatus::kNothingLeft || step.published) {
    nothing_left_since_ = step.decided ? std::nullopt : nothing_left_since_;
    has_explored_ = has_explored_ || step.published != nullptr;
    return step.published;
  }
  nothing_left_since_ = nothing_left_since_.value_or(now);
  if (!explorer_.has_open_clusters() ||
      to_seconds(now - *nothing_left_since_) >= kConfirmNothingLeftS) {
    end_exploration(StopReason::kNothingLeft, now);
  }
  return nullptr;
}

// From home there may be a way to what could not be reached from where the exploration ended.
void Mission::resume_at_home() {
  if (reason_ == StopReason::kNothingLeft && explorer_.has_open_clusters() &&
      resumptions_ < kMaxResumptions) {
    ++resumptions_;
    reason_ = StopReason::kNone;
    state_ = MissionState::kExplore;
  }
}

// What failed before is tried through tight gaps, then out of a pocket.
std::vector<Vector3d> Mission::route_home(Time now) {
  const int attempt = strikes_ / kStrikesPerFailure % 3;
  if (attempt == 2) {
    return explorer_.way_out(pilot_, now);
  }
  RouteSearch& routes = attempt == 0 ? explorer_.routes() : explorer_.tight_routes();
  const RouteLattice::Node home = routes.lattice().nearest(home_m_);
  routes.run(pilot_.clearance(),
             pilot_.next_start_point(now).position_m,
             {home},
             std::numeric_limits<double>::infinity());
  return routes.route_m(home);
}

bool Mission::is_home(Time now) const {
  return (pilot_.next_start_point(now).position_m - home_m_).head<2>().norm() < kArrivedM;
}

// It is there, or has tried for long enough.
bool Mission::is_way_home_over(Time now) const {
  return strikes_ >= kMaxStrikes || (pilot_.is_at_rest(now) && is_home(now));
}

TrajectoryPtr Mission::fly_home(Time now) {
  const double waited_s = to_seconds(now - last_leg_);
  const bool in_danger = !pilot_.is_at_rest(now) && pilot_.unsafe_from(now).has_value();
  const bool is_due = pilot_.is_at_rest(now) ? waited_s >= kRetryIntervalS
                                             : waited_s >= explorer_config_.replan.max_interval_s;
  TrajectoryPtr leg;
  if (in_danger || is_due) {
    last_leg_ = now;
    std::vector<Vector3d> route = route_home(now);
    int strikes = kStrikesPerFailure;
    if (!route.empty()) {
      const Result<TrajectoryPtr, PlanError> flown =
          pilot_.fly({std::move(route),
                      home_yaw_rad_,
                      FlightMode::kTransit,
                      explorer_config_.limits.limits_for(FlightMode::kTransit)},
                     now);
      leg = flown ? *flown : nullptr;
      strikes = flown ? 0 : strikes_of(flown.error());
    }
    strikes_ = leg || !pilot_.is_at_rest(now) ? 0 : strikes_ + strikes;
  }
  if (in_danger && !leg) {
    const Result<TrajectoryPtr, PlanError> braked = pilot_.brake(now);
    leg = braked ? *braked : nullptr;
  }
  return leg;
}

// Over once somebody has been heard, has been waited for, or there is no way home.
TrajectoryPtr Mission::meet(Time now) {
  if (!meeting_.is_wanted()) {
    state_ = MissionState::kExplore;
    return nullptr;
  }
  if (!is_way_home_over(now)) {
    return fly_home(now);
  }
  strikes_ = 0;
  if (is_home(now)) {
    meeting_.wait(now);
  } else {
    meeting_.give_up();
  }
  return nullptr;
}

TrajectoryPtr Mission::descend(Time now) {
  if (!pilot_.is_at_rest(now)) {
    return nullptr;
  }
  const Vector3d here = pilot_.next_start_point(now).position_m;
  const PlanConfig& plan = explorer_config_.plan;
  const double resolution_m = explorer_config_.map.resolution_m;
  const double lowest_m = pilot_.clearance().geometry().box_m().min().z() + plan.vehicle_radius_m +
                          plan.margin_m + resolution_m;
  if (here.z() < lowest_m + kArrivedM || strikes_ >= kMaxStrikes) {
    state_ = MissionState::kLand;
    return nullptr;
  }
  return to_seconds(now - last_leg_) < kRetryIntervalS
             ? nullptr
             : fly_leg({here.x(), here.y(), lowest_m}, now);
}

void Mission::set_peers(const team::Peers& peers, Time now) {
  const Vector3d here_m = pilot_.follower().newest()->sample(now).position_m;
  explorer_.set_peers(peers);
  meeting_.observe(peers, here_m, now);
  lookout_.hear(peers, here_m);
}

void Mission::watch_out(const MapSnapshot& map, Time now) {
  const team::TeamConfig& team = explorer_config_.team;
  if (team.size == 1) {
    return;
  }
  lookout_.see(map.intruders_m, now);
  pilot_.be_wary(lookout_.is_wary(now) ? std::optional(explorer_config_.camera.max_range_m)
                                       : std::nullopt);
  pilot_.set_traffic(team::traffic_of(team, explorer_.peers(), lookout_.movers(now), now));
  explorer_.avoid(pilot_.barriers(now));
}

MissionStep Mission::on_map(const MapSnapshotPtr& snapshot, Time now) {
  MissionStep step;
  watch_out(*snapshot, now);
  pilot_.update_map(snapshot);
  has_map_ = true;
  explorer_.observe(snapshot);
  const bool is_late = to_seconds(now - started_at_) >= config_.time_limit_s;
  if (reason_ == StopReason::kNone && state_ != MissionState::kWaiting && is_late) {
    step.published = stop(StopReason::kTimeLimit, now);
    return step;
  }
  if (is_flying_unwatched() && !pilot_.is_at_rest(now) && pilot_.unsafe_from(now)) {
    step.published = brake(now);
    return step;
  }
  switch (state_) {
    case MissionState::kWaiting:
    case MissionState::kPaused:
      break;
    case MissionState::kTakeOff:
      step.published = climb(now);
      break;
    case MissionState::kMeet:
      step.published = meet(now);
      break;
    case MissionState::kExplore:
      if (meeting_.is_wanted() && explorer_.is_abroad()) {
        explorer_.forget_target();
        strikes_ = 0;
        state_ = MissionState::kMeet;
        step.published = meet(now);
        break;
      }
      step.explore = explorer_.step(pilot_, now);
      step.published = explore(step.explore, now);
      break;
    case MissionState::kReturnHome:
      if (!is_way_home_over(now)) {
        step.published = fly_home(now);
        break;
      }
      state_ = MissionState::kDescend;
      strikes_ = 0;
      resume_at_home();
      break;
    case MissionState::kDescend:
      step.published = descend(now);
      break;
    case MissionState::kLand:
    case MissionState::kStopped:
      break;
  }
  return step;
}

}  // namespace understory
