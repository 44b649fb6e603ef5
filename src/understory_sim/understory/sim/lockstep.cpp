// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/lockstep.hpp"

#include <utility>

#include "understory/bridge/flight_loop.hpp"

namespace understory {
namespace {

constexpr Duration kPhysicsStep = std::chrono::milliseconds(2);
constexpr Duration kSetpointPeriod = std::chrono::milliseconds(10);
// To stand on the ground or to hover still, after the mission's last word.
constexpr Duration kSettleTime = std::chrono::seconds(8);

Vector3d start_position(const StartConfig& start) {
  return {start.x_m, start.y_m, start.z_m};
}

Mapper make_mapper(const SimulationConfig& config, const MapSnapshot* resumed) {
  return resumed != nullptr ? Mapper(*resumed)
                            : Mapper(config.explorer.map, config.scene.box.box_m());
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
                   const Forest& forest,
                   const Rng& rng,
                   const MapSnapshot* resumed,
                   StepHook on_step,
                   StageTimes& times)
    : config_(config),
      on_step_(std::move(on_step)),
      times_(times),
      stages_(times),
      vehicle_(config.vehicle,
               start_position(config.scene.start),
               config.scene.start.yaw_rad,
               rng.fork("wind")),
      law_(config.vehicle.airframe, config.control),
      renderer_(forest),
      camera_(config.explorer.camera),
      body_from_optical_(body_from_optical(config.explorer.camera)),
      noise_rng_(rng.fork("depth noise")),
      mapper_(make_mapper(config, resumed)),
      mission_(config.mission,
               config.explorer,
               mapper_.geometry(),
               start_position(config.scene.start),
               config.scene.start.yaw_rad,
               Time{}) {
  law_.set_mode(ControlMode::kTrack);
  mapper_.mark_free(launch_site_m(config.mission, start_position(config.scene.start)), Time{});
}

Setpoint Lockstep::setpoint_now() {
  if (now_ >= setpoint_time_ + kSetpointPeriod || now_ == Time{}) {
    setpoint_ = to_setpoint(mission_.pilot().follower().sample(now_));
    setpoint_time_ = now_;
  }
  return extrapolated(setpoint_, to_seconds(now_ - setpoint_time_));
}

void Lockstep::fly_until(Time exposure) {
  const double step_s = to_seconds(kPhysicsStep);
  if (mission_.state() == MissionState::kLand && law_.mode() == ControlMode::kTrack) {
    law_.set_mode(ControlMode::kLand);
  }
  while (now_ < exposure) {
    vehicle_.step(law_.update(vehicle_.state(), setpoint_now(), step_s), step_s);
    now_ += kPhysicsStep;
    on_step_(now_, vehicle_.state());
  }
}

DepthImage Lockstep::expose(const Pose& world_from_optical) {
  return add_noise(renderer_.render(camera_, world_from_optical, std::move(image_)),
                   config_.depth_noise,
                   noise_rng_);
}

MissionStep Lockstep::decide(const MapSnapshotPtr& map) {
  const auto start = std::chrono::steady_clock::now();
  MissionStep step = mission_.on_map(map, now_);
  times_.add(step.explore.decided ? stages_.decision : stages_.update,
             std::chrono::steady_clock::now() - start);
  return step;
}

LockstepFrame Lockstep::advance() {
  const double frame_s = 1.0 / config_.explorer.camera.rate_hz;
  const Time exposure{duration_from_seconds(static_cast<double>(frame_++) * frame_s)};
  {
    const StageTimer timer(times_, stages_.flight);
    fly_until(exposure);
  }
  Pose world_from_body = Pose::Identity();
  world_from_body.translation() = vehicle_.state().position_m;
  world_from_body.linear() = vehicle_.state().world_from_body.toRotationMatrix();
  const Pose world_from_optical = world_from_body * body_from_optical_;
  {
    const StageTimer timer(times_, stages_.camera);
    image_ = expose(world_from_optical);
  }
  LockstepFrame frame;
  frame.time = now_;
  {
    const StageTimer timer(times_, stages_.map);
    // A frame that cannot be integrated changes nothing; the mission flies on with the map it has.
    if (!mapper_.integrate(camera_, image_.view(), world_from_optical, now_)) {
      ++skipped_frames_;
    }
    frame.map = mapper_.publish();
  }
  frame.step = decide(frame.map);
  if (!mission_.is_over()) {
    over_since_ = now_;
  }
  return frame;
}

bool Lockstep::is_over() const {
  if (!mission_.is_over()) {
    return false;
  }
  const bool is_down = law_.mode() == ControlMode::kIdle;
  const bool is_still = mission_.state() == MissionState::kStopped &&
                        mission_.pilot().is_at_rest(now_) &&
                        vehicle_.state().velocity_mps.norm() < 0.05;
  return is_down || is_still || now_ >= over_since_ + kSettleTime;
}

}  // namespace understory
