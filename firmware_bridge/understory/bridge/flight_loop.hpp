// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The flight thread: at a fixed rate it samples the newest trajectory, lets the setpoint through
// the gate, sends it and reads the vehicle's telemetry. Absolute deadlines on the steady clock,
// SCHED_FIFO where the system allows it; in the loop no allocation, no lock that others hold, no
// exception. Trajectory times are wall-clock time (microseconds since 1970). Before the first
// trajectory it sends a hold where the vehicle is; every trajectory ends at rest, so with nobody
// left to plan the vehicle ends at rest. Construction throws on wrong configuration; any one thread
// may call offer() and settle(), any thread arm(), disarm() and kill(), any other one
// wait_for_tick().
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

#include "understory/bridge/clocks.hpp"
#include "understory/bridge/flight_control.hpp"

namespace understory {

struct FlightConfig {
  double rate_hz = 100.0;
  int priority = 70;
  GateConfig gate;
  TrackingConfig tracking;

  void visit(FieldVisitor& f) {
    f.field("rate_hz", rate_hz, in_range(20.0, 400.0), "of setpoints");
    f.field("priority",
            priority,
            in_range(0, 98),
            "of the flight thread under SCHED_FIFO, where allowed; 0: an ordinary thread");
    f.section("gate", gate, "The last check of every setpoint.");
    f.section("tracking", tracking, "Whether the vehicle is where it should be.");
  }
};

// What one turn of the loop did. Times in nanoseconds are of the steady clock.
struct FlightTick {
  std::int64_t due_ns = 0;
  std::int64_t woken_ns = 0;
  std::int64_t sent_ns = 0;
  Time sent_wall{};                  // the same by the wall clock
  std::optional<Setpoint> setpoint;  // nothing: it is not known where the vehicle is
  Telemetry telemetry;
  std::uint64_t trajectory_id = 0;  // 0: none yet
  Time depth_stamp{};               // of that trajectory
  bool is_at_rest = true;           // that trajectory has ended
  bool is_first_of_trajectory = false;
  // The first turn that knew of a new trajectory, whether or not its time had come.
  bool is_first_with_plan = false;
  Time plan_depth_stamp{};  // of the newest trajectory known
  bool is_astray = false;   // not where the trajectory is: it holds from then on
  std::uint64_t gate_violations = 0;
  std::uint64_t skipped_deadlines = 0;
};

class FlightLoop {
 public:
  FlightLoop(const FlightConfig& config, const Box3d& box_m, std::unique_ptr<Autopilot> autopilot);
  FlightLoop(const FlightLoop&) = delete;
  FlightLoop& operator=(const FlightLoop&) = delete;
  ~FlightLoop();  // at once; see settle()

  // Takes over at its own start time.
  void offer(const TrajectoryPtr& trajectory, Time now);
  // What of it comes true, telemetry tells.
  void arm();
  void disarm();
  void kill();
  // Waits until what is flown has ended at rest, but not longer than this.
  void settle(std::chrono::milliseconds at_most) const;

  // The next turn that nobody has seen yet; nothing when none comes in time.
  [[nodiscard]] std::optional<FlightTick> wait_for_tick(std::chrono::milliseconds at_most);

  [[nodiscard]] bool is_real_time() const { return is_real_time_; }
  // Turns that nobody waited for in time.
  [[nodiscard]] std::uint64_t lost_ticks() const { return lost_ticks_; }

 private:
  struct Mailboxes;

  void run();
  void turn(FlightTick& tick);
  void pass_wish_on();
  [[nodiscard]] bool become_real_time() const;

  FlightConfig config_;
  FlightControl control_;
  std::unique_ptr<Autopilot> autopilot_;
  TrajectoryFollower follower_;  // of the thread that offers
  std::unique_ptr<Mailboxes> mailboxes_;
  std::atomic<bool> is_stopping_{false};
  enum class Wish : std::uint8_t { kNone, kArm, kDisarm, kKill };
  std::atomic<Wish> wish_{Wish::kNone};  // not yet passed on
  std::atomic<bool> is_real_time_{false};
  std::atomic<std::uint64_t> lost_ticks_{0};
  std::thread thread_;
};

}  // namespace understory
