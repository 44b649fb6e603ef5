// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest_truth.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "understory/base/rng.hpp"

namespace understory {
namespace {

Forest one_stump() {
  Forest forest;
  forest.trunks = {{Vector2d(2, 0), 0.5}};
  forest.trunk_height_m = 1.0;
  return forest;
}

// By dense sampling: independent of the closest-point formula.
double sampled_distance_m(const TriangleMesh& mesh, const Vector3d& p) {
  double best_m = 1e9;
  for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
    const Vector3d a = mesh.vertices_m[triangle[0]].cast<double>();
    const Vector3d b = mesh.vertices_m[triangle[1]].cast<double>();
    const Vector3d c = mesh.vertices_m[triangle[2]].cast<double>();
    for (int i = 0; i <= 100; ++i) {
      for (int j = 0; j + i <= 100; ++j) {
        best_m = std::min(best_m, (a + 0.01 * i * (b - a) + 0.01 * j * (c - a) - p).norm());
      }
    }
  }
  return best_m;
}

TEST(ForestTruth, MeasuresTheDistanceToACylinderFromEverySide) {
  const ForestTruth truth(one_stump());

  EXPECT_DOUBLE_EQ(truth.distance_to_nearest_surface_m({0, 0, 0.5}, 9.0), 1.5);    // beside
  EXPECT_DOUBLE_EQ(truth.distance_to_nearest_surface_m({2, 0.1, 1.7}, 9.0), 0.7);  // above
  EXPECT_DOUBLE_EQ(truth.distance_to_nearest_surface_m({2, 0.8, 1.4}, 9.0), 0.5);  // to the rim
  EXPECT_DOUBLE_EQ(truth.distance_to_nearest_surface_m({2, 0.1, 0.5}, 9.0), -0.4);
  EXPECT_DOUBLE_EQ(truth.distance_to_nearest_surface_m({2, 0, 0.9}, 9.0), -0.1);
  EXPECT_DOUBLE_EQ(truth.distance_to_nearest_surface_m({2, 0, 0.9}, 0.2), -0.1);
}

TEST(ForestTruth, StopsAtTheGivenMaximum) {
  const ForestTruth truth(one_stump());

  EXPECT_EQ(truth.distance_to_nearest_surface_m({0, 0, 0.5}, 1.0), 1.0);
  EXPECT_EQ(truth.distance_to_nearest_surface_m({2, 0, 9.0}, 1.0), 1.0);
  EXPECT_EQ(ForestTruth(Forest{}).distance_to_nearest_surface_m({0, 0, 0}, 3.0), 3.0);
}

TEST(ForestTruth, AgreesWithSampledTrianglesAndTakesTheNearerOfTrunkAndMesh) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Rng rng(seed);
    const auto coordinate = [&] { return static_cast<float>(rng.uniform(-2, 2)); };
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < 4; ++i) {
      for (int corner = 0; corner < 3; ++corner) {
        mesh.vertices_m.emplace_back(500.0F + coordinate(), coordinate(), coordinate());
      }
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    Forest forest;
    forest.meshes = {TriangleMesh{{{900, 0, 0}, {901, 0, 0}, {900, 1, 0}}, {{0, 1, 2}}}, mesh};
    forest.trunks = {{Vector2d(500, 0), 0.1}};
    const ForestTruth truth(forest);

    for (int i = 0; i < 20; ++i) {
      const double x_m = rng.uniform(497, 503);
      const double y_m = rng.uniform(-3, 3);
      const Vector3d p(x_m, y_m, rng.uniform(-3, 2.5));
      const double trunk_m = (p.head<2>() - Vector2d(500, 0)).norm() - 0.1;

      EXPECT_NEAR(truth.distance_to_nearest_surface_m(p, 9.0),
                  std::min(trunk_m, sampled_distance_m(mesh, p)),
                  0.01)
          << "seed " << seed << ", point " << p.transpose();
    }
  }
}

}  // namespace
}  // namespace understory
