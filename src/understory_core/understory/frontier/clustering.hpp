// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Shapes of clusters: splitting along the principal axis (Zhou et al. 2021, FUEL, section IV-A),
// nearness of two clusters. Pure functions on voxel lists.
#pragma once

#include <vector>

#include "understory/frontier/cluster.hpp"

namespace understory {

// Pieces at most max_length_voxels long in xy along their principal axis, in a fixed order.
[[nodiscard]] std::vector<std::vector<VoxelIndex>> split_along_principal_axis(
    std::vector<VoxelIndex> voxels, double max_length_voxels);

// Fills mean and bounds from the voxels.
[[nodiscard]] Cluster make_cluster(std::vector<VoxelIndex> voxels, const GridGeometry& geometry);

// Is a voxel of one within the distance of a voxel of the other, centre to centre?
[[nodiscard]] bool are_neighbours(const Cluster& a,
                                  const Cluster& b,
                                  double distance_m,
                                  const GridGeometry& geometry);

// Corners of the convex hull of the points, counter-clockwise (Andrew's monotone chain 1979).
[[nodiscard]] std::vector<Vector2d> convex_hull(std::vector<Vector2d> points);

// 0 inside.
[[nodiscard]] double distance_to_convex_polygon(const std::vector<Vector2d>& corners,
                                                const Vector2d& point);

}  // namespace understory
