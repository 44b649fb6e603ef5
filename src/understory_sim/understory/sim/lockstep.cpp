// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/lockstep.hpp"

#include <algorithm>
#include <utility>

#include "understory/sim/teammates_in_view.hpp"

namespace understory {
namespace {

constexpr Duration kSetpointPeriod = std::chrono::milliseconds(10);
// To stand on the ground or to hover still, after the mission's last word.
constexpr Duration kSettleTime = std::chrono::seconds(8);

// The vehicle flies once it is armed; the mission begins then.
MissionConfig waiting(MissionConfig mission) {
  mission.auto_start = false;
  return mission;
}

Mapper make_mapper(const SimulationConfig& config, const MapSnapshot* resumed) {
  return resumed != nullptr ? Mapper(*resumed)
                            : Mapper(config.explorer.map, config.scene.box.box_m());
}

Pose world_from_body(const VehicleState& state) {
  Pose pose = Pose::Identity();
  pose.translation() = state.position_m;
  pose.linear() = state.world_from_body.toRotationMatrix();
  return pose;
}

}  // namespace

Lockstep::Stages::Stages(StageTimes& times)
    : flight(times.stage("flight")),
      camera(times.stage("camera")),
      map(times.stage("map")),
      update(times.stage("update")),
      decision(times.stage("decision")) {}

// NOLINTNEXTLINE(readability-function-size): all that a mission is made of, once
Lockstep::Lockstep(const SimulationConfig& config,
                   std::shared_ptr<const DepthRenderer> renderer,
                   const Rng& rng,
                   const MapSnapshot* resumed,
                   StepHook on_step,
                   StageTimes& times)
    : config_(config),
      on_step_(std::move(on_step)),
      times_(times),
      stages_(times),
      bus_(vehicle_of(config),
           can::HostStationConfig{},
           world_from_start(config.scene.start),
           rng,
           Time{}),
      control_(GateConfig{}, TrackingConfig{}, config.scene.box.box_m()),
      renderer_(std::move(renderer)),
      camera_(config.explorer.camera),
      body_from_optical_(body_from_optical(config.explorer.camera)),
      noise_rng_(rng.fork("depth noise")),
      mapper_(make_mapper(config, resumed)),
      mission_(waiting(config.mission),
               config.explorer,
               mapper_.geometry(),
               bus_.vehicle().state().position_m,
               config.scene.start.yaw_rad,
               Time{}) {
  mapper_.mark_free(launch_site_m(config.mission, bus_.vehicle().state().position_m), Time{});
}

void Lockstep::follow_vehicle(const Telemetry& telemetry) {
  if (mission_.state() == MissionState::kWaiting) {
    if (telemetry.is_following) {
      mission_.start(now_);
    } else if (telemetry.link.host == can::HostState::kReady) {
      bus_.host().arm();
    }
  } else if (mission_.state() == MissionState::kLand) {
    bus_.host().disarm();
  } else if (control_.is_astray()) {
    mission_.stop(StopReason::kTrackingLost, now_);
  } else if (telemetry.is_battery_low && mission_.stop_reason() == StopReason::kNone) {
    mission_.return_home(now_);
  }
  is_down_ = telemetry.is_down;
}

void Lockstep::fly_tick() {
  const Telemetry telemetry = bus_.host().receive(now_);
  const FlightDecision decision = control_.decide(&mission_.pilot().follower(), telemetry, now_);
  bus_.host().send(decision.setpoint, decision.is_hold, now_);
  follow_vehicle(telemetry);
  next_tick_ += kSetpointPeriod;
}

void Lockstep::fly_until(Time exposure) {
  while (now_ < exposure) {
    if (now_ >= next_tick_) {
      fly_tick();
    }
    now_ = std::min(next_tick_, exposure);
    bus_.advance(now_, on_step_);
  }
}

DepthImage Lockstep::expose(const Pose& world_from_optical, const std::vector<Vector3d>& others_m) {
  DepthImage image = renderer_->render(camera_, world_from_optical, std::move(image_));
  if (!others_m.empty()) {
    image = add_teammates(std::move(image),
                          camera_,
                          world_from_optical,
                          others_m,
                          config_.explorer.plan.vehicle_radius_m);
  }
  return add_noise(std::move(image), config_.depth_noise, noise_rng_);
}

MapSnapshotPtr Lockstep::update_map() {
  const Pose world_from_optical = world_from_body(bus_.vehicle().odometry()) * body_from_optical_;
  if (member_) {
    image_ = member_->mask(std::move(image_), camera_, world_from_optical, now_);
  }
  // A frame that cannot be integrated changes nothing; the mission flies on with the map it has.
  if (!mapper_.integrate(camera_, image_.view(), world_from_optical, now_)) {
    ++skipped_frames_;
  }
  return mapper_.publish();
}

MissionStep Lockstep::decide(const MapSnapshotPtr& map) {
  const auto start = std::chrono::steady_clock::now();
  MissionStep step = mission_.on_map(map, now_);
  times_.add(step.explore.decided ? stages_.decision : stages_.update,
             std::chrono::steady_clock::now() - start);
  return step;
}

LockstepFrame Lockstep::advance() {
  fly_to_next_exposure();
  return see_and_decide({});
}

void Lockstep::fly_to_next_exposure() {
  const double frame_s = 1.0 / config_.explorer.camera.rate_hz;
  const Time exposure{duration_from_seconds(static_cast<double>(frame_++) * frame_s)};
  const StageTimer timer(times_, stages_.flight);
  fly_until(exposure);
}

LockstepFrame Lockstep::see_and_decide(const std::vector<Vector3d>& others_m) {
  {
    const StageTimer timer(times_, stages_.camera);
    image_ = expose(world_from_body(vehicle()) * body_from_optical_, others_m);
  }
  LockstepFrame frame;
  frame.time = now_;
  {
    const StageTimer timer(times_, stages_.map);
    frame.own_map = update_map();
    frame.map = member_ ? member_->fuse(*frame.own_map, now_) : frame.own_map;
  }
  if (member_) {
    mission_.set_peers(member_->peers(now_), now_);
  }
  frame.step = decide(frame.map);
  if (member_) {
    member_->tell(bus_.vehicle().odometry(), mission_, now_);
  }
  if (!mission_.is_over()) {
    over_since_ = now_;
  }
  return frame;
}

bool Lockstep::is_over() const {
  if (!mission_.is_over()) {
    return false;
  }
  const bool is_still = mission_.state() == MissionState::kStopped &&
                        mission_.pilot().is_at_rest(now_) && vehicle().velocity_mps.norm() < 0.05;
  return is_down_ || is_still || now_ >= over_since_ + kSettleTime;
}

}  // namespace understory
