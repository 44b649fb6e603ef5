// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A mission in a map made by hand, whose vehicle flies exactly as told. The map changes only where
// a test changes it. World frame, SI units; a map update every 0.1 s.
#pragma once

#include <utility>

#include "support/snapshot_builder.hpp"
#include "understory/mission.hpp"

namespace understory::test {

// Along x and 2 m wide and high; what lies outside of this piece of it is unknown.
inline SnapshotBuilder hall_known_between(double x_min_m, double x_max_m) {
  SnapshotBuilder builder(0.1, Box3d(Vector3d(-8.0, -1.0, 0.0), Vector3d(8.0, 1.0, 2.0)));
  builder.set_box({Vector3d(x_min_m, -1.0, 0.0), Vector3d(x_max_m, 1.0, 2.0)}, VoxelState::kFree);
  return builder;
}

// There is something to see at either end, and a while to fly there.
inline SnapshotBuilder long_hall() {
  return hall_known_between(-5.0, 6.0);
}

struct MissionFlight {
  explicit MissionFlight(SnapshotBuilder map,
                         const MissionConfig& config = {},
                         const Vector3d& home_m = {0.0, 0.0, 1.0})
      : builder(std::move(map)),
        mission(config, explorer, builder.geometry(), home_m, 0.0, Time{}) {}

  const MissionStep& step() {
    now += Duration(100000);
    last = mission.on_map(builder.build(), now);
    return last;
  }
  void fly_for(double seconds) {
    for (const Time end = now + duration_from_seconds(seconds); now < end;) {
      step();
    }
  }
  template <class Condition>
  bool fly_until(Condition condition, double at_most_s = 60.0) {
    const Time end = now + duration_from_seconds(at_most_s);
    while (!condition()) {
      if (now >= end) {
        return false;
      }
      step();
    }
    return true;
  }
  bool fly_until_state(MissionState state) {
    return fly_until([&] { return mission.state() == state; });
  }
  bool fly_until_fast() {
    return fly_until([&] { return here().velocity_mps.norm() > 1.2; });
  }
  bool fly_until_something_new_is_published() {
    step();
    return fly_until([&] { return last.published != nullptr; });
  }
  bool fly_until_at_rest() {
    return fly_until([&] { return mission.pilot().is_at_rest(now); });
  }

  [[nodiscard]] TrajectoryPoint here() const { return mission.pilot().follower().sample(now); }

  ExplorerConfig explorer;
  SnapshotBuilder builder;
  Mission mission;
  MissionStep last;
  Time now{};
};

}  // namespace understory::test
