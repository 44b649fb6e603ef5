// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What every nodelet here does: a start that fails loudly (roscpp would swallow the reason),
// callbacks whose exceptions are counted and reported instead of ending the process, and a
// diagnostic status once a second. Single-threaded handles only: callbacks of one nodelet never
// overlap, so it needs no lock. Subclasses override start() and, if they have more to say,
// health().
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <nodelet/nodelet.h>
#include <ros/node_handle.h>

namespace understory {

class GuardedNodelet : public nodelet::Nodelet {
 public:
  GuardedNodelet() = default;
  GuardedNodelet(const GuardedNodelet&) = delete;
  GuardedNodelet& operator=(const GuardedNodelet&) = delete;
  ~GuardedNodelet() override = default;

 protected:
  struct Health {
    std::int8_t level = diagnostic_msgs::DiagnosticStatus::OK;
    std::string message = "ok";
  };

  virtual void start() = 0;  // may throw; the nodelet is then not loaded
  [[nodiscard]] virtual Health health();
  // After an exception from a callback.
  virtual void on_failure() {}

  // Runs it; an exception is counted and reported.
  void guarded(const std::function<void()>& callback);
  void count(const std::string& what, std::uint64_t by = 1) { counters_[what] += by; }
  // Bad input: counted, logged now and then, and a warning in the next diagnostics.
  void skip(const std::string& counter, const std::string& why);
  void set_counter(const std::string& what, std::uint64_t value) { counters_[what] = value; }
  // Marks of one stage on one frame, for `understory latency`.
  void trace(const char* stage, const ros::Time& exposure, std::int64_t begin_ns);
  void trace(const char* stage,
             const ros::Time& exposure,
             std::int64_t begin_ns,
             std::int64_t end_ns);

 private:
  void onInit() final;
  void publish_health();
  // roscpp's throttled macros count per line of code, so that all nodelets would share one.
  [[nodiscard]] bool is_log_due();

  ros::Publisher diagnostics_publisher_;
  ros::Publisher trace_publisher_;
  ros::WallTimer health_timer_;
  std::map<std::string, std::uint64_t> counters_;
  std::uint64_t failures_ = 0;
  std::uint64_t calls_ = 0;
  std::atomic<std::int64_t> tracing_ns_{0};  // what the marks themselves cost
  int fail_after_calls_ = 0;  // fault injection for tests: parameter ~fail_after_calls
  std::string last_failure_;
  std::int64_t last_log_ns_ = 0;
  std::string last_skip_;  // since the last diagnostics
};

}  // namespace understory
