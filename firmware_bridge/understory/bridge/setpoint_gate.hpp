// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The last check before a setpoint leaves: finite, inside the fence, within speed, acceleration and
// step limits. It shares no code with the planner. What does not pass is counted and replaced by a
// hold at the last good position; before there is one, by nothing. World frame, SI units; the
// flight thread alone; no allocation, cannot fail.
#pragma once

#include <cstdint>
#include <optional>

#include "understory/autopilot/control_law.hpp"
#include "understory/base/config.hpp"
#include "understory/base/geometry.hpp"
#include "understory/base/time.hpp"

namespace understory {

struct GateConfig {
  double max_speed_mps = 5.0;
  double max_acceleration_mps2 = 8.0;
  double max_step_m = 0.15;
  double fence_margin_m = 0.3;

  void visit(FieldVisitor& f) {
    f.field("max_speed_mps", max_speed_mps, in_range(0.1, 50.0), "of a setpoint");
    f.field("max_acceleration_mps2", max_acceleration_mps2, in_range(0.1, 100.0), "of a setpoint");
    f.field("max_step_m",
            max_step_m,
            in_range(0.01, 5.0),
            "between two setpoints, beyond what their speed explains");
    f.field("fence_margin_m",
            fence_margin_m,
            in_range(0.0, 100.0),
            "setpoints may lie this far outside the exploration box");
  }
};

class SetpointGate {
 public:
  SetpointGate(const GateConfig& config, const Box3d& box_m);

  // `setpoint` itself, or a hold; nothing where no setpoint was good yet.
  [[nodiscard]] std::optional<Setpoint> pass(const Setpoint& setpoint, Time now);

  // What was sent does not tell any more where the vehicle is: the next one is judged without it.
  void forget() { last_.reset(); }

  [[nodiscard]] std::uint64_t violations() const { return violations_; }

 private:
  [[nodiscard]] bool is_acceptable(const Setpoint& setpoint, Time now) const;

  GateConfig config_;
  Box3d fence_m_;
  std::optional<Setpoint> last_;
  Time last_time_{};
  std::uint64_t violations_ = 0;
};

}  // namespace understory
