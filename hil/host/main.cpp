// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// understory_host: the bridge's end of the bus without ROS, camera and forest, for trying a vehicle
// on the bench: arms it, climbs, flies circles, and lands it. A line per state change and one a
// second on standard output. Exit status: 0 flown and landed, 1 not so, 2 wrong use.
#include <csignal>
#include <cstdio>
#include <optional>
#include <random>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <sched.h>

#include "understory/bridge/can_autopilot.hpp"
#include "understory/bridge/clocks.hpp"
#include "understory/bridge/setpoint_gate.hpp"
#include "understory/port/candump_writer.hpp"
#include "understory/port/socket_can_port.hpp"

namespace understory {
namespace {

constexpr int kPriority = 70;
constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr double kLandingPatienceS = 20.0;
constexpr double kClimbMps = 0.5;
constexpr double kFenceM = 100.0;

volatile std::sig_atomic_t g_interrupts = 0;  // NOLINT: the only way a signal handler can speak

struct Options {
  std::string interface = "vcan0";
  double rate_hz = 100.0;
  double duration_s = 10.0;
  double patience_s = 10.0;
  double height_m = 1.0;
  double radius_m = 1.0;
  double speed_mps = 1.0;
  bool is_rearming = false;
  bool is_killing = false;
  std::string log_file;
};

// Up, then round and round through where it came up, ever at rest at its beginning.
Setpoint circle(const Options& options, const Setpoint& start, double time_s) {
  Setpoint setpoint = start;
  const double climb_s = options.height_m / kClimbMps;
  const double climbed_s = std::min(time_s, climb_s);
  setpoint.position_m.z() += kClimbMps * climbed_s;
  if (time_s < climb_s) {
    setpoint.velocity_mps.z() = kClimbMps;
    return setpoint;
  }
  // Speed grows over the first two seconds, so that nothing jumps.
  const double ramp_s = 2.0;
  const double flown_s = time_s - climb_s;
  const double rate_radps = options.speed_mps / options.radius_m;
  const double share = std::min(1.0, flown_s / ramp_s);
  const double angle_rad =
      rate_radps * (flown_s < ramp_s ? 0.5 * flown_s * share : flown_s - 0.5 * ramp_s);
  const double turn_radps = rate_radps * share;
  const Vector3d outward(std::cos(angle_rad), std::sin(angle_rad), 0.0);
  const Vector3d along(-std::sin(angle_rad), std::cos(angle_rad), 0.0);
  setpoint.position_m += options.radius_m * (outward - Vector3d::UnitX());
  setpoint.velocity_mps = options.radius_m * turn_radps * along;
  const double growth_radps2 = flown_s < ramp_s ? rate_radps / ramp_s : 0.0;
  setpoint.acceleration_mps2 =
      options.radius_m * (growth_radps2 * along - turn_radps * turn_radps * outward);
  return setpoint;
}

class Host {
 public:
  explicit Host(const Options& options)
      : options_(options),
        autopilot_(port(options.interface), can::HostStationConfig{}, chance()),
        gate_(GateConfig{}, Box3d(Vector3d::Constant(-kFenceM), Vector3d::Constant(kFenceM))) {
    if (!options.log_file.empty()) {
      can::CandumpLogConfig log;
      log.path = options.log_file;
      log.interface = options.interface;
      autopilot_.node().set_tap(std::make_shared<can::CandumpWriter>(log));
    }
  }

  int run() {
    const auto period_ns =
        static_cast<std::int64_t>(static_cast<double>(kNanoseconds) / options_.rate_hz);
    begun_ns_ = steady_ns();
    std::int64_t due_ns = begun_ns_;
    while (!has_ended_) {
      due_ns = std::max(due_ns + period_ns, steady_ns() - period_ns);
      autopilot_.run_until(due_ns);
      turn(wall_time());
    }
    return is_good_ ? 0 : 1;
  }

 private:
  static std::unique_ptr<can::CanPort> port(const std::string& interface) {
    can::IdSet ids;
    for (const can::MessageInfo& message : can::kMessages) {
      ids[message.id] = true;
    }
    return std::make_unique<can::SocketCanPort>(interface, ids);
  }
  static std::uint16_t chance() {
    std::random_device device;
    return static_cast<std::uint16_t>(device());
  }

  [[nodiscard]] double since_s(std::int64_t begin_ns) const {
    return static_cast<double>(steady_ns() - begin_ns) * 1e-9;
  }

  void turn(Time now) {
    const Telemetry telemetry = autopilot_.receive(now);
    wish(telemetry);
    std::optional<Setpoint> setpoint;
    if (!telemetry.is_valid) {
      // Where it is is not known: no further than where it was to be. The gate has passed that, and
      // must not learn that nothing has moved meanwhile.
      if (last_) {
        last_->velocity_mps.setZero();
        last_->acceleration_mps2.setZero();
      }
      setpoint = last_;
      start_.reset();
    } else if (telemetry.is_following && !is_landing_) {
      if (!start_) {
        start_ = hold_at(telemetry);
        flying_ns_ = steady_ns();
      }
      setpoint = gate_.pass(circle(options_, *start_, since_s(flying_ns_)), now);
    } else {
      start_.reset();  // whatever comes next begins where it is
      setpoint = gate_.pass(hold_at(telemetry), now);
    }
    last_ = setpoint;
    autopilot_.send(setpoint, !start_.has_value(), now);
    show(telemetry, now);
  }

  static Setpoint hold_at(const Telemetry& telemetry) {
    Setpoint hold;
    hold.position_m = telemetry.state.position_m;
    hold.yaw_rad = yaw_of(telemetry.state.world_from_body);
    return hold;
  }

  void wish(const Telemetry& telemetry) {
    has_flown_ = has_flown_ || telemetry.is_following;
    const bool is_ready = telemetry.link.host == can::HostState::kReady;
    if (is_ready && !is_landing_ && (!has_flown_ || options_.is_rearming)) {
      autopilot_.arm();
    }
    const bool is_time = flying_ns_ > 0 && since_s(flying_ns_) > options_.duration_s;
    if ((g_interrupts > 0 || is_time) && !is_landing_) {
      is_landing_ = true;
      landing_ns_ = steady_ns();
      options_.is_killing ? autopilot_.kill() : autopilot_.disarm();
    }
    const bool is_late = is_landing_ ? since_s(landing_ns_) > kLandingPatienceS
                                     : !has_flown_ && since_s(begun_ns_) > options_.patience_s;
    const bool is_killed = telemetry.link.vehicle == can::State::kKilled;
    // Who has landed by itself is down too.
    const bool is_down = has_flown_ && telemetry.is_down && !options_.is_rearming;
    is_good_ = is_landing_ && has_flown_ && (telemetry.is_down || is_killed);
    const bool is_unflown = is_landing_ && !has_flown_;
    has_ended_ = is_good_ || is_down || is_late || is_unflown || g_interrupts > 1;
  }

  void show(const Telemetry& telemetry, Time now) {
    const LinkStatus& link = telemetry.link;
    const std::string state = fmt::format("{} {} {} ({})",
                                          can::to_string(link.host),
                                          can::to_string(link.vehicle),
                                          can::to_string(link.reason),
                                          can::to_string(link.problem));
    const bool is_due = now - shown_at_ >= std::chrono::seconds(1);
    if (state == shown_ && !is_due && !has_ended_) {
      return;
    }
    shown_ = state;
    shown_at_ = now;
    const Vector3d& at_m = telemetry.state.position_m;
    fmt::print(
        "{:.3f} {} at {:.2f} {:.2f} {:.2f} sent {} refused {} torn {} lost {} wrong {} full {} "
        "expired {} reopened {} sessions {} rtt {:.3f} ms battery {:.0f} %\n",
        to_seconds(now),
        state,
        at_m.x(),
        at_m.y(),
        at_m.z(),
        link.sets_sent,
        link.sets_not_flown,
        link.sets_torn,
        link.frames_lost,
        link.frames_wrong,
        link.tx_full,
        link.tx_expired,
        link.bus_reopened,
        link.sessions,
        1e3 * to_seconds(link.round_trip),
        link.battery_percent);
    static_cast<void>(std::fflush(stdout));
  }

  Options options_;
  CanAutopilot autopilot_;
  SetpointGate gate_;
  std::int64_t begun_ns_ = 0;
  std::int64_t flying_ns_ = 0;
  std::int64_t landing_ns_ = 0;
  std::optional<Setpoint> start_;
  std::optional<Setpoint> last_;
  bool has_flown_ = false;
  bool is_landing_ = false;
  bool has_ended_ = false;
  bool is_good_ = false;
  std::string shown_;
  Time shown_at_{};
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("--interface", options.interface, "the CAN interface (default: vcan0)");
  app.add_option("--rate", options.rate_hz, "of setpoints, Hz (default: 100)")
      ->check(CLI::Range(20.0, 200.0));
  app.add_option("--duration", options.duration_s, "of the flight, s (default: 10)");
  app.add_option("--patience", options.patience_s, "not armed for so long, s: give up");
  app.add_option("--height", options.height_m, "to climb, m (default: 1)");
  app.add_option("--radius", options.radius_m, "of the circles, m (default: 1)");
  app.add_option("--speed", options.speed_mps, "on them, m/s (default: 1)");
  app.add_flag("--rearm", options.is_rearming, "arm again whenever the vehicle is ready");
  app.add_flag("--kill", options.is_killing, "at the end stop the motors instead of landing");
  app.add_option("--log", options.log_file, "every frame, as candump -l writes it");
}

int run_main(int count, char** words) {
  CLI::App app("Flies a vehicle on a CAN bus in circles: the bridge without ROS, for the bench.",
               "understory_host");
  app.footer("Ctrl-C lands the vehicle, a second one ends at once. More: docs/hil.md.");
  Options options;
  add_options(app, options);
  try {
    app.parse(count, words);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  for (const int number : {SIGINT, SIGTERM}) {
    std::signal(number, [](int) { g_interrupts = g_interrupts + 1; });
  }
  try {
    Host host(options);
    sched_param parameter{};
    parameter.sched_priority = kPriority;
    // Where it is not allowed, it is a little late now and then.
    static_cast<void>(sched_setscheduler(0, SCHED_FIFO, &parameter));
    return host.run();
  } catch (const std::exception& error) {
    fmt::print(stderr, "understory_host: {}\n", error.what());
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
