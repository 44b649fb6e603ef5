// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/guarded_nodelet.hpp"

#include <stdexcept>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <understory_msgs/Trace.h>

#include "understory/bridge/flight_loop.hpp"
#include "understory/nodelets/conversions.hpp"

namespace understory {
namespace {

using diagnostic_msgs::DiagnosticStatus;

constexpr double kHealthPeriodS = 1.0;
constexpr std::int64_t kReportPeriodNs = 5'000'000'000;

diagnostic_msgs::KeyValue key_value(const std::string& key, const std::string& value) {
  diagnostic_msgs::KeyValue pair;
  pair.key = key;
  pair.value = value;
  return pair;
}

}  // namespace

void GuardedNodelet::onInit() {
  try {
    ros::NodeHandle& nh = getNodeHandle();
    diagnostics_publisher_ = nh.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
    trace_publisher_ = nh.advertise<understory_msgs::Trace>("trace", 200);
    getPrivateNodeHandle().getParam("fail_after_calls", fail_after_calls_);
    start();
    health_timer_ = nh.createWallTimer(ros::WallDuration(kHealthPeriodS),
                                       [this](const ros::WallTimerEvent&) { publish_health(); });
  } catch (const std::exception& error) {
    NODELET_FATAL("%s: %s", getName().c_str(), error.what());
    // The loader destroys the callback queues of a nodelet that fails before the nodelet itself.
    getNodeHandle().shutdown();
    getPrivateNodeHandle().shutdown();
    throw;
  }
}

void GuardedNodelet::guarded(const std::function<void()>& callback) {
  try {
    ++calls_;
    if (fail_after_calls_ > 0 && calls_ > static_cast<std::uint64_t>(fail_after_calls_)) {
      throw std::runtime_error("made to fail by parameter fail_after_calls");
    }
    callback();
    return;
  } catch (const std::exception& error) {
    last_failure_ = error.what();
  } catch (...) {
    last_failure_ = "unknown exception";
  }
  ++failures_;
  if (is_log_due()) {
    NODELET_ERROR("%s: %s (%lu failures)", getName().c_str(), last_failure_.c_str(), failures_);
  }
  try {
    on_failure();
  } catch (const std::exception& error) {
    last_failure_ = error.what();
  }
}

void GuardedNodelet::skip(const std::string& counter, const std::string& why) {
  count(counter);
  last_skip_ = why;
  if (is_log_due()) {
    NODELET_WARN("%s: skipped: %s", getName().c_str(), why.c_str());
  }
}

bool GuardedNodelet::is_log_due() {
  const std::int64_t now_ns = steady_ns();
  const bool is_due = last_log_ns_ == 0 || now_ns - last_log_ns_ >= kReportPeriodNs;
  last_log_ns_ = is_due ? now_ns : last_log_ns_;
  return is_due;
}

GuardedNodelet::Health GuardedNodelet::health() {
  return {};
}

void GuardedNodelet::trace(const char* stage, const ros::Time& exposure, std::int64_t begin_ns) {
  trace(stage, exposure, begin_ns, steady_ns());
}

void GuardedNodelet::trace(const char* stage,
                           const ros::Time& exposure,
                           std::int64_t begin_ns,
                           std::int64_t end_ns) {
  const std::int64_t began_ns = steady_ns();
  auto mark = boost::make_shared<understory_msgs::Trace>();
  // As clouds keep it, whole microseconds: one name per frame, whatever its driver's stamp.
  mark->header.stamp = to_ros(to_time(exposure));
  mark->stage = stage;
  mark->begin_ns = static_cast<std::uint64_t>(begin_ns);
  mark->end_ns = static_cast<std::uint64_t>(end_ns);
  trace_publisher_.publish(understory_msgs::TraceConstPtr(mark));
  tracing_ns_ += steady_ns() - began_ns;
}

void GuardedNodelet::publish_health() {
  Health found = health();
  if (!last_skip_.empty() && found.level == DiagnosticStatus::OK) {
    found = {DiagnosticStatus::WARN, "skipped: " + last_skip_};
    last_skip_.clear();
  }
  if (failures_ > 0) {
    found = {DiagnosticStatus::ERROR, "failed: " + last_failure_};
  }
  auto array = boost::make_shared<diagnostic_msgs::DiagnosticArray>();
  array->header.stamp = ros::Time::now();
  DiagnosticStatus status;
  status.level = found.level;
  status.name = getName();
  status.message = found.message;
  status.hardware_id = "understory";
  for (const auto& [name, value] : counters_) {
    status.values.push_back(key_value(name, std::to_string(value)));
  }
  status.values.push_back(key_value("tracing_us", std::to_string(tracing_ns_ / 1000)));
  status.values.push_back(key_value("failures", std::to_string(failures_)));
  array->status.push_back(status);
  diagnostics_publisher_.publish(diagnostic_msgs::DiagnosticArrayConstPtr(array));
}

}  // namespace understory
