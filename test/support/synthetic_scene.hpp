// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A forest that tests can ray cast exactly and without the simulator: round vertical trunks of
// unlimited height on level ground. World frame, metres.
#pragma once

#include <cstdint>
#include <vector>

#include "understory/base/geometry.hpp"
#include "understory/map/mapper.hpp"
#include "understory/sense/camera_model.hpp"

namespace understory::test {

struct RoundTrunk {
  Vector2d center_m;
  double radius_m;
};

struct SyntheticScene {
  std::vector<RoundTrunk> trunks;
  double ground_z_m = 0.0;

  // Along the unit direction to the first surface; +inf if there is none.
  [[nodiscard]] double distance_m(const Vector3d& from_m, const Vector3d& direction) const;
  [[nodiscard]] bool inside_a_trunk(const Vector3d& point_m) const;
};

// Trunks of 0.1 to 0.3 m radius at seeded places in a square from (0, 0), at least 0.8 m of gap
// between them.
[[nodiscard]] SyntheticScene seeded_forest(double edge_m, double trunks_per_m2, std::uint64_t seed);

// What a perfect camera sees; +inf beyond its range.
[[nodiscard]] DepthImage render(const SyntheticScene& scene,
                                const CameraModel& camera,
                                const Pose& world_from_optical);

// Level flight through the scene, always 0.4 m or more from the trunks, turning slowly: optical
// poses one camera frame (1/15 s) apart at 2 m/s.
[[nodiscard]] std::vector<Pose> flight_through(const SyntheticScene& scene,
                                               double edge_m,
                                               double height_m,
                                               std::size_t frames);

// The image's points as an unorganised cloud in the optical frame, three floats each; a pixel
// without return becomes a point at `no_return_factor` times the range, NaN ones are left out.
[[nodiscard]] std::vector<float> to_points(const DepthImage& image,
                                           const CameraModel& camera,
                                           double no_return_factor);

[[nodiscard]] CameraConfig camera_config(int width_px, int height_px);

}  // namespace understory::test
