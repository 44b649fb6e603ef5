// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/bridge/flight_loop.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <deque>
#include <limits>

#include <boost/lockfree/spsc_queue.hpp>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>

namespace understory {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr std::size_t kPlansInFlight = 64;
constexpr std::size_t kTicksInFlight = 256;
constexpr std::uint64_t kFlying = std::numeric_limits<std::uint64_t>::max();

timespec to_timespec(std::int64_t nanoseconds) {
  return {static_cast<time_t>(nanoseconds / kNanoseconds),
          static_cast<long>(nanoseconds % kNanoseconds)};
}

class Semaphore {
 public:
  Semaphore() { sem_init(&semaphore_, 0, 0); }
  Semaphore(const Semaphore&) = delete;
  Semaphore& operator=(const Semaphore&) = delete;
  ~Semaphore() { sem_destroy(&semaphore_); }

  void post() { sem_post(&semaphore_); }
  bool wait(std::chrono::milliseconds at_most) {
    const timespec until = to_timespec(steady_ns() + std::chrono::nanoseconds(at_most).count());
    int status = 0;
    do {
      status = sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &until);
    } while (status != 0 && errno == EINTR);
    return status == 0;
  }

 private:
  sem_t semaphore_{};
};

}  // namespace

// One writer and one reader each. Plans belong to the thread that offers them, because freeing
// memory is not for the flight thread: it gets pointers and tells how many it has taken; of those
// only the last is still in use.
struct FlightLoop::Mailboxes {
  boost::lockfree::spsc_queue<const TrajectoryFollower*, boost::lockfree::capacity<kPlansInFlight>>
      to_fly;
  boost::lockfree::spsc_queue<FlightTick, boost::lockfree::capacity<kTicksInFlight>> ticks;
  Semaphore tick_arrived;
  std::atomic<std::uint64_t> taken{0};
  std::atomic<std::uint64_t> at_rest_after{0};  // so many plans; kFlying: not at rest

  // Of the thread that offers.
  std::deque<std::unique_ptr<const TrajectoryFollower>> plans;  // that may still be in use
  std::uint64_t offered = 0;

  // Of the flight thread.
  const TrajectoryFollower* plan = nullptr;
  std::uint64_t plan_count = 0;
  std::uint64_t sent_id = 0;
};

FlightLoop::FlightLoop(const FlightConfig& config,
                       const Box3d& box_m,
                       std::unique_ptr<Autopilot> autopilot)
    : config_(config),
      control_(config.gate, config.tracking, box_m),
      autopilot_(std::move(autopilot)),
      mailboxes_(std::make_unique<Mailboxes>()) {
  thread_ = std::thread([this] { run(); });
}

FlightLoop::~FlightLoop() {
  is_stopping_ = true;
  thread_.join();
}

void FlightLoop::offer(const TrajectoryPtr& trajectory, Time now) {
  Mailboxes& boxes = *mailboxes_;
  const std::uint64_t taken = boxes.taken;
  while (boxes.offered - boxes.plans.size() + 1 < taken) {
    boxes.plans.pop_front();
  }
  follower_.set(trajectory, now);
  boxes.plans.push_back(std::make_unique<const TrajectoryFollower>(follower_));
  ++boxes.offered;
  while (!boxes.to_fly.push(boxes.plans.back().get())) {
    std::this_thread::yield();  // full only if the flight thread has not run for many decisions
  }
}

void FlightLoop::arm() {
  // Whoever wants the motors to stop comes first.
  Wish expected = Wish::kNone;
  wish_.compare_exchange_strong(expected, Wish::kArm);
}

void FlightLoop::disarm() {
  Wish earlier = wish_;
  while (earlier != Wish::kKill && !wish_.compare_exchange_weak(earlier, Wish::kDisarm)) {
  }
}

void FlightLoop::kill() {
  wish_ = Wish::kKill;
}

void FlightLoop::pass_wish_on() {
  switch (wish_.exchange(Wish::kNone)) {
    case Wish::kArm:
      autopilot_->arm();
      break;
    case Wish::kDisarm:
      autopilot_->disarm();
      break;
    case Wish::kKill:
      autopilot_->kill();
      break;
    case Wish::kNone:
      break;
  }
}

void FlightLoop::settle(std::chrono::milliseconds at_most) const {
  const auto until = std::chrono::steady_clock::now() + at_most;
  // At rest with an older plan does not count.
  while (mailboxes_->at_rest_after != mailboxes_->offered &&
         std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::optional<FlightTick> FlightLoop::wait_for_tick(std::chrono::milliseconds at_most) {
  std::optional<FlightTick> tick;
  if (mailboxes_->tick_arrived.wait(at_most)) {
    mailboxes_->ticks.consume_one([&tick](const FlightTick& next) { tick = next; });
  }
  return tick;
}

bool FlightLoop::become_real_time() const {
  pthread_setname_np(pthread_self(), "flight");
  sched_param parameter{};
  parameter.sched_priority = config_.priority;
  return config_.priority > 0 && pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
}

void FlightLoop::turn(FlightTick& tick) {
  Mailboxes& boxes = *mailboxes_;
  while (boxes.to_fly.pop(boxes.plan)) {
    ++boxes.plan_count;
    tick.is_first_with_plan = true;
  }
  if (boxes.plan != nullptr) {
    tick.plan_depth_stamp = boxes.plan->newest()->depth_stamp;
  }
  boxes.taken = boxes.plan_count;
  pass_wish_on();
  const Time now = wall_time();
  const FlightDecision decision = control_.decide(boxes.plan, autopilot_->receive(now), now);
  tick.setpoint = decision.setpoint;
  tick.is_at_rest = decision.is_at_rest;
  tick.is_astray = control_.is_astray();
  if (decision.flown != nullptr) {
    tick.trajectory_id = decision.flown->id;
    tick.depth_stamp = decision.flown->depth_stamp;
    tick.is_first_of_trajectory = decision.flown->id != boxes.sent_id;
    boxes.sent_id = decision.flown->id;
  }
  autopilot_->send(decision.setpoint, decision.is_hold, now);
  tick.sent_ns = steady_ns();
  tick.sent_wall = wall_time();
  tick.telemetry = autopilot_->receive(now);
  tick.gate_violations = control_.gate_violations();
  // What will never be flown need not be waited for.
  const bool is_flying = decision.flown != nullptr && !tick.is_at_rest;
  boxes.at_rest_after = is_flying ? kFlying : boxes.plan_count;
}

void FlightLoop::run() {
  is_real_time_ = become_real_time();
  const auto period_ns =
      static_cast<std::int64_t>(static_cast<double>(kNanoseconds) / config_.rate_hz);
  std::int64_t due_ns = steady_ns() + period_ns;
  std::uint64_t skipped = 0;
  while (!is_stopping_) {
    autopilot_->run_until(due_ns);
    FlightTick tick;
    tick.due_ns = due_ns;
    tick.woken_ns = steady_ns();
    tick.skipped_deadlines = skipped;
    turn(tick);
    if (mailboxes_->ticks.push(tick)) {
      mailboxes_->tick_arrived.post();
    } else {
      ++lost_ticks_;
    }
    due_ns += period_ns;
    // After a long stall the missed setpoints are not made up for: the next one is due from now.
    const std::int64_t behind_ns = steady_ns() - due_ns;
    if (behind_ns > 0) {
      const std::int64_t missed = behind_ns / period_ns + 1;
      skipped += static_cast<std::uint64_t>(missed);
      due_ns += missed * period_ns;
    }
  }
}

}  // namespace understory
