// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A map of which a test says what is known, and the clusters that the finder makes of it.
#pragma once

#include <vector>

#include "support/snapshot_builder.hpp"
#include "understory/frontier/frontier_finder.hpp"

namespace understory::test {

inline const Box3d kFrontierBox(Vector3d(-6.0, -6.0, 0.0), Vector3d(6.0, 6.0, 2.0));

struct FrontierBench {
  explicit FrontierBench(SnapshotBuilder& builder, const FrontierConfig& config = {})
      : routes(builder.geometry(), 0.32), finder(config, CameraConfig{}, builder.geometry()) {}

  const std::vector<ClusterPtr>& update(SnapshotBuilder& builder) {
    snapshot = builder.build();
    clearance.update(snapshot);
    finder.observe(snapshot);
    return finder.form(clearance, routes);
  }

  ClearanceMap clearance;
  RouteSearch routes;
  FrontierFinder finder;
  MapSnapshotPtr snapshot;
};

}  // namespace understory::test
