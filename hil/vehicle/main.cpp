// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// understory_vehicle: a vehicle on a CAN bus, for tests: autopilot, four ESCs, battery and rigid
// body in real time. Exit status: 0 ended when told to, 1 the bus could not be used, 2 wrong use.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include "understory/bridge/clocks.hpp"
#include "understory/can/messages.hpp"
#include "understory/port/socket_can_port.hpp"
#include "understory/sim/mission_record.hpp"
#include "understory/sim/scenario.hpp"
#include "understory/sim/simulated_vehicle.hpp"
#include "vehicle/commands.hpp"

namespace understory {
namespace {

constexpr int kPriority = 60;  // under the flight thread: on real hardware each has its own core
constexpr Duration kLongestCatchUp = std::chrono::milliseconds(100);
constexpr Duration kListenPeriod = std::chrono::milliseconds(20);

volatile std::sig_atomic_t g_interrupted = 0;  // NOLINT: the only way a signal handler can speak

struct Options {
  std::string interface = "vcan0";
  ScenarioChoice scenario;
  std::uint64_t seed = 1;
  double rate_hz = 100.0;
  bool is_direct = false;
  std::vector<std::string> faults;
  std::string config_folder;
};

class StandIn {
 public:
  StandIn(const Options& options, const SimulatedVehicleConfig& config, const Pose& start)
      : config_(config),
        start_(start),
        seed_(options.seed ^ static_cast<std::uint64_t>(steady_ns())),
        interface_(options.interface),
        lines_(STDIN_FILENO) {
    for (const std::string& text : options.faults) {
      faults_.push_back(parse_timed_fault(text));
    }
    build();
  }

  void run() {
    Time now = wall_time();
    Time world = now;
    Time listened = now;
    while (g_interrupted == 0 && !is_quitting_) {
      if (is_frozen_ || now - world > kLongestCatchUp || now < world - kLongestCatchUp) {
        world = now;  // it has stood still, or the clock was set
      }
      if (is_frozen_) {
        usleep(static_cast<useconds_t>(kListenPeriod.count()));
        now = wall_time();
      } else {
        world += SimulatedVehicle::kStep;
        vehicle_->run_until(now, world);
        now = vehicle_->node().now();
        vehicle_->step(world);
        watch(world);
      }
      if (now - listened >= kListenPeriod) {
        listened = now;
        listen(now);
      }
    }
    report();
  }

 private:
  void build() {
    can::IdSet ids;
    for (const can::MessageInfo& message : can::kMessages) {
      ids[message.id] = true;
    }
    // Another nonce every time, as chance would have it.
    vehicle_ = std::make_unique<SimulatedVehicle>(
        config_, start_, Rng(seed_), std::make_unique<can::SocketCanPort>(interface_, ids));
  }

  void obey(const FaultCommand& command, Time now) {
    switch (command.fault) {
      case Fault::kFreeze:
        is_frozen_ = true;
        break;
      case Fault::kResume:
        is_frozen_ = false;
        break;
      case Fault::kRestart:
        vehicle_->restart_autopilot(Rng(++seed_));
        break;
      case Fault::kLoseSensors:
        vehicle_->lose_sensors();
        break;
      case Fault::kDrain:
        vehicle_->drain_battery(command.value);
        break;
      case Fault::kFailEsc:
        vehicle_->fail_esc(static_cast<std::size_t>(command.value));
        break;
      case Fault::kQuit:
        is_quitting_ = true;
        break;
    }
    static_cast<void>(now);
  }

  void listen(Time now) {
    for (const std::string& line : lines_.read()) {
      try {
        obey(parse_fault(line), now);
        fmt::print("{}\n", line);
      } catch (const std::invalid_argument& error) {
        fmt::print(stderr, "understory_vehicle: {}\n", error.what());
      }
    }
    while (armed_at_ && next_fault_ < faults_.size() &&
           to_seconds(now - *armed_at_) >= faults_[next_fault_].at_s) {
      obey(faults_[next_fault_++].command, now);
    }
  }

  // Says what the autopilot does, whenever that changes.
  void watch(Time now) {
    const can::Supervisor& supervisor = vehicle_->station().supervisor();
    if (supervisor.state() == shown_state_ && supervisor.reason() == shown_reason_) {
      return;
    }
    shown_state_ = supervisor.state();
    shown_reason_ = supervisor.reason();
    if (shown_state_ == can::State::kArmed && !armed_at_) {
      armed_at_ = now;
    }
    const Vector3d& at_m = vehicle_->state().position_m;
    fmt::print("{:.3f} {} {} at {:.2f} {:.2f} {:.2f}\n",
               to_seconds(now),
               can::to_string(shown_state_),
               can::to_string(shown_reason_),
               at_m.x(),
               at_m.y(),
               at_m.z());
    static_cast<void>(std::fflush(stdout));
  }

  void report() const {
    const can::CanNodeCounters& node = vehicle_->node().counters();
    fmt::print("{} frames received, {} flooded, {} setpoints flown\n",
               node.received,
               node.flooded,
               vehicle_->station().setpoints_flown());
  }

  SimulatedVehicleConfig config_;
  Pose start_;
  std::uint64_t seed_;
  std::string interface_;
  LineReader lines_;
  std::vector<TimedFault> faults_;
  std::size_t next_fault_ = 0;
  std::unique_ptr<SimulatedVehicle> vehicle_;
  bool is_frozen_ = false;
  bool is_quitting_ = false;
  std::optional<Time> armed_at_;
  can::State shown_state_ = can::State::kInit;
  can::StateReason shown_reason_ = can::StateReason::kNone;
};

void become_real_time() {
  sched_param parameter{};
  parameter.sched_priority = kPriority;
  // Where it is not allowed, it is a little late now and then.
  static_cast<void>(sched_setscheduler(0, SCHED_FIFO, &parameter));
  static_cast<void>(mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT));
}

std::string default_config_folder() {
  const char* root = std::getenv("UNDERSTORY_ROOT");
  return root == nullptr ? "config" : std::string(root) + "/config";
}

int run(const Options& options) {
  SimulationConfig scenario = load_scenario(options.config_folder, options.scenario);
  // The forest decides where the start is.
  const World world = World::of_vehicle(scenario, options.seed);
  SimulatedVehicleConfig vehicle = vehicle_of(world.config);
  vehicle.telemetry_rate_hz = options.rate_hz;
  vehicle.is_direct = options.is_direct;
  StandIn stand_in(options, vehicle, world_from_start(world.config.scene.start));
  become_real_time();
  stand_in.run();
  return 0;
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("--interface", options.interface, "the CAN interface (default: vcan0)");
  app.add_option("--scenario", options.scenario.scenario, "where it starts: name or YAML file");
  app.add_option("--forest", options.scenario.forest_file, "stem map (CSV)");
  app.add_option("--crop", options.scenario.crop, "X0,Y0,W,H of the stem map, metres");
  app.add_option("--overrides", options.scenario.overrides, "YAML over the scenario's keys");
  app.add_option("--config-folder", options.config_folder, "where config/*.yaml lie");
  app.add_option("--seed", options.seed, "of the forest (default: 1)");
  app.add_option("--rate", options.rate_hz, "of odometry, Hz (default: 100)")
      ->check(CLI::Range(10.0, 200.0));
  app.add_flag("--direct", options.is_direct, "ESCs only: the host commands the motors itself");
  app.add_option("--fault", options.faults, "SECONDS:COMMAND, counted from arming; may be repeated")
      ->allow_extra_args(false);
}

int run_main(int count, char** words) {
  CLI::App app("A vehicle on a CAN bus, for tests: autopilot, four ESCs, battery, rigid body.",
               "understory_vehicle");
  app.footer(
      "Lines on standard input are faults: freeze, resume, restart, lose_sensors, drain PERCENT,\n"
      "fail_esc 0..3, quit. Ctrl-C ends it. Protocol: docs/hil.md, docs/can_protocol.md.");
  Options options;
  options.config_folder = default_config_folder();
  add_options(app, options);
  try {
    app.parse(count, words);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  for (const int number : {SIGINT, SIGTERM}) {
    std::signal(number, [](int) { g_interrupted = 1; });
  }
  try {
    return run(options);
  } catch (const ConfigError& error) {
    fmt::print(stderr, "understory_vehicle: {}\n", error.what());
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "understory_vehicle: {}\n", error.what());
    return 2;
  }
}

}  // namespace
}  // namespace understory

int main(int count, char** words) {
  try {
    return understory::run_main(count, words);
  } catch (...) {
    return 2;  // out of memory while saying what was wrong
  }
}
