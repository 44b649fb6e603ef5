// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/frontier/clustering.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace understory {
namespace {

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Unit vector of the largest spread in xy.
Vector2d principal_axis(const std::vector<VoxelIndex>& voxels, const Vector2d& mean) {
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (const VoxelIndex& voxel : voxels) {
    const Vector2d offset = voxel.head<2>().cast<double>() - mean;
    xx += offset.x() * offset.x();
    xy += offset.x() * offset.y();
    yy += offset.y() * offset.y();
  }
  const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);
  return {std::cos(angle), std::sin(angle)};
}

// Those whose centres lie no further than this from the box on any axis.
std::vector<VoxelIndex> voxels_near(const std::vector<VoxelIndex>& voxels,
                                    Box3d bounds_m,
                                    double distance_m,
                                    const GridGeometry& geometry) {
  bounds_m.min().array() -= distance_m;
  bounds_m.max().array() += distance_m;
  std::vector<VoxelIndex> near;
  std::copy_if(
      voxels.begin(), voxels.end(), std::back_inserter(near), [&](const VoxelIndex& voxel) {
        return bounds_m.contains(geometry.center_of(voxel));
      });
  return near;
}

}  // namespace

std::vector<std::vector<VoxelIndex>> split_along_principal_axis(std::vector<VoxelIndex> voxels,
                                                                double max_length_voxels) {
  std::vector<std::vector<VoxelIndex>> pieces;
  std::vector<std::vector<VoxelIndex>> open;
  open.push_back(std::move(voxels));
  while (!open.empty()) {
    std::vector<VoxelIndex> piece = std::move(open.back());
    open.pop_back();
    Vector2d mean = Vector2d::Zero();
    for (const VoxelIndex& voxel : piece) {
      mean += voxel.head<2>().cast<double>();
    }
    mean /= static_cast<double>(piece.size());
    const Vector2d axis = principal_axis(piece, mean);
    const auto along = [&](const VoxelIndex& voxel) {
      return axis.dot(voxel.head<2>().cast<double>() - mean);
    };
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const VoxelIndex& voxel : piece) {
      low = std::min(low, along(voxel));
      high = std::max(high, along(voxel));
    }
    if (high - low <= max_length_voxels) {
      pieces.push_back(std::move(piece));
      continue;
    }
    const auto middle = std::stable_partition(
        piece.begin(), piece.end(), [&](const VoxelIndex& voxel) { return along(voxel) < 0.0; });
    open.emplace_back(middle, piece.end());
    open.emplace_back(piece.begin(), middle);
  }
  return pieces;
}

Cluster make_cluster(std::vector<VoxelIndex> voxels, const GridGeometry& geometry) {
  Cluster cluster;
  cluster.voxels = std::move(voxels);
  for (const VoxelIndex& voxel : cluster.voxels) {
    const Vector3d center = geometry.center_of(voxel);
    cluster.mean_m += center;
    cluster.bounds_m.extend(center);
  }
  cluster.mean_m /= static_cast<double>(cluster.voxels.size());
  return cluster;
}

bool are_neighbours(const Cluster& a,
                    const Cluster& b,
                    double distance_m,
                    const GridGeometry& geometry) {
  if (a.bounds_m.squaredExteriorDistance(b.bounds_m) > distance_m * distance_m) {
    return false;
  }
  const double reach = distance_m / geometry.resolution_m();
  const auto squared_reach = static_cast<int>(reach * reach + 1e-6);
  const std::vector<VoxelIndex> near_b = voxels_near(a.voxels, b.bounds_m, distance_m, geometry);
  const std::vector<VoxelIndex> near_a =
      voxels_near(b.voxels, a.bounds_m, distance_m + geometry.resolution_m(), geometry);
  return std::any_of(near_b.begin(), near_b.end(), [&](const VoxelIndex& voxel) {
    return std::any_of(near_a.begin(), near_a.end(), [&](const VoxelIndex& other) {
      return (voxel - other).squaredNorm() <= squared_reach;
    });
  });
}

std::vector<Vector2d> convex_hull(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) {
    return points;
  }
  std::vector<Vector2d> hull;
  const auto append = [&hull](const Vector2d& point, std::size_t keep) {
    while (hull.size() >= keep + 2 &&
           cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(point);
  };
  for (const Vector2d& point : points) {
    append(point, 0);
  }
  const std::size_t lower = hull.size() - 1;
  for (auto point = points.rbegin() + 1; point != points.rend(); ++point) {
    append(*point, lower);
  }
  hull.pop_back();
  return hull;
}

double distance_to_convex_polygon(const std::vector<Vector2d>& corners, const Vector2d& point) {
  bool inside = corners.size() >= 3;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d& a = corners[i];
    const Vector2d edge = corners[(i + 1) % corners.size()] - a;
    inside = inside && cross(edge, point - a) >= 0.0;
    const double along = edge.squaredNorm() > 0.0
                             ? std::clamp(edge.dot(point - a) / edge.squaredNorm(), 0.0, 1.0)
                             : 0.0;
    least = std::min(least, (point - a - along * edge).norm());
  }
  return inside ? 0.0 : least;
}

}  // namespace understory
