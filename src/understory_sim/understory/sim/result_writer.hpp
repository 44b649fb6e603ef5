// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a mission leaves behind: a folder with result.json, ticks.csv, config.yaml, trunks.csv,
// topview.pgm (and map.ot, figures and report.html, written by others). SI units, world frame.
// Everything but result.json is the same bytes for the same seed; what the machine's speed decides
// (realtime_factor, peak_rss_mb, stages) stands in result.json only. Throws ResultError with one
// line that names the file, except TickWriter::append, which runs in flight. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "understory/base/geometry.hpp"
#include "understory/map/map_snapshot.hpp"
#include "understory/sim/forest.hpp"
#include "understory/sim/stage_times.hpp"

namespace understory {

class ResultError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Creates the folder where needed and finds out now what would lose the result after the flight:
// a file in the way, no permission, a disk that is full. Removes the results of an earlier mission
// (not its map, from which this one may be resumed), so that the two are never mixed.
void prepare_result_folder(const std::string& folder);

// Where topview.pgm lies: its left lower corner, and the edge of a pixel.
struct Topview {
  double x0_m = 0.0;
  double y0_m = 0.0;
  double cell_m = 0.0;
  int width = 0;
  int height = 0;
};

struct VolumeAt {
  double time_s = 0.0;
  double volume_m3 = 0.0;
};

// Of one vehicle of a team.
struct TeamMateResult {
  int id = 0;
  bool is_lost = false;
  std::optional<double> completion_time_s;
  double distance_m = 0.0;
  double speed_mean_mps = 0.0;
  double speed_std_mps = 0.0;
  double seen_volume_m3 = 0.0;  // by itself
  std::vector<VolumeAt> seen_at;
  double coverage = 0.0;  // of what it knows of the team's map
  std::uint64_t bytes_sent = 0;
  double bytes_per_s = 0.0;
  std::uint64_t peak_bytes_per_s = 0;
  std::uint64_t steady_peak_bytes_per_s = 0;  // without what is sent when a contact begins
};

// Keys of result.json by the same names. What never happened is null there.
struct MissionResult {
  // Completed, and nothing is known to have been hit.
  [[nodiscard]] bool is_good() const { return completed && collisions.value_or(0) == 0; }

  bool completed = false;
  std::string stop_reason;
  std::optional<double> completion_time_s;  // when the planner said "nothing left"
  double mission_time_s = 0.0;              // until landed or stopped
  std::optional<double> coverage;           // 0 .. 1; null on a real flight
  std::optional<double> t50_s;
  std::optional<double> t90_s;
  std::optional<double> t95_s;
  std::optional<double> t99_s;
  double distance_m = 0.0;
  double speed_mean_mps = 0.0;
  double speed_std_mps = 0.0;
  double speed_max_mps = 0.0;
  double yaw_rate_max_radps = 0.0;
  std::optional<std::uint64_t> collisions;  // null on a real flight
  std::optional<double> min_clearance_m;    // null in a forest without trunks
  double explored_volume_m3 = 0.0;
  std::vector<VolumeAt> volume_at;           // at fixed times
  std::map<std::string, double> mode_share;  // of flight time, by mode
  std::uint64_t dormant_clusters = 0;        // at the end
  std::uint64_t set_aside_targets = 0;       // likewise
  std::uint64_t replans = 0;
  std::map<std::string, std::uint64_t> counters;
  std::vector<TeamMateResult> team;          // of a team's result: distance and speed are means
  std::optional<double> least_separation_m;  // between the centres of two vehicles

  std::uint64_t seed = 0;
  std::string strategy;
  std::string speed_cap;
  std::string scenario;
  std::string commit;
  double vehicle_radius_m = 0.20;            // nearer to a trunk than this is a collision
  std::optional<double> explorer_speed_mps;  // limits in force, drawn in the report
  std::optional<double> collector_speed_mps;
  std::optional<double> yaw_rate_limit_radps;
  std::optional<Box3d> box_m;
  std::optional<Topview> topview;

  double realtime_factor = 0.0;
  double peak_rss_mb = 0.0;
  std::vector<StageStats> stages;
};

[[nodiscard]] std::string to_json(const MissionResult& result);

// Each of these replaces the file as a whole or leaves it as it was.
void write_text_file(const std::string& path, std::string_view text);
void write_result_json(const std::string& path, const MissionResult& result);
// Columns x_m, y_m, radius_m: the trunks that reach into the box.
void write_trunks(const std::string& path, const std::vector<Trunk>& trunks, const Box3d& box_m);
// Binary PGM, one pixel per column of voxels, first row northernmost. 0: a voxel of the column is
// occupied; else 1 + 254 x the known share, so 1: nothing known, 255: all known.
[[nodiscard]] Topview write_topview(const MapSnapshot& map, const std::string& path);

struct TickRow {
  double time_s = 0.0;
  Vector3d position_m = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  double yaw_rad = 0.0;
  double yaw_rate_radps = 0.0;
  std::string_view mode;           // a word
  std::string_view mission_state;  // a word
  std::optional<double> coverage;
  double explored_volume_m3 = 0.0;
  std::size_t clusters = 0;
  std::size_t trails = 0;
  std::size_t dormant = 0;
  std::optional<std::uint64_t> target_id;
  std::optional<Vector3d> target_m;
  std::optional<double> clearance_m;  // true distance from the centre to the nearest surface
};

class TickWriter {
 public:
  // Throws when the file cannot be opened. So many rows at most are not on disk yet.
  explicit TickWriter(const std::string& path, int rows_per_flush = 64);
  TickWriter(const TickWriter&) = delete;
  TickWriter& operator=(const TickWriter&) = delete;
  TickWriter(TickWriter&&) = delete;
  TickWriter& operator=(TickWriter&&) = delete;
  ~TickWriter();  // writes what is left, without a word about failure

  // Never throws; a failure to write is kept for close().
  void append(const TickRow& row);
  // Throws when any row was lost. Nothing may be appended afterwards.
  void close();

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { (void)std::fclose(file); }
  };

  void flush();

  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::string buffer_;
  int rows_per_flush_;
  int buffered_rows_ = 0;
  int first_errno_ = 0;
};

}  // namespace understory
