// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/result_writer.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace understory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kProbeBytes = 1U << 20U;
constexpr std::uintmax_t kSpaceBytes = 32U << 20U;  // a long mission writes less
constexpr const char* kMapFile = "map.ot";
constexpr std::array<const char*, 17> kOwnFiles = {"result.json",
                                                   "ticks.csv",
                                                   "config.yaml",
                                                   "trunks.csv",
                                                   "topview.pgm",
                                                   "report.html",
                                                   "coverage.png",
                                                   "speed.png",
                                                   "modes.png",
                                                   "path.png",
                                                   "times.png",
                                                   "trace.csv",
                                                   "trace.json",
                                                   "latency.csv",
                                                   "latency.png",
                                                   "team_path.png",
                                                   "team_volume.png"};

[[noreturn]] void fail(const std::string& path, const char* what, int error_number) {
  throw ResultError(path + ": " + what + ": " + std::generic_category().message(error_number));
}

struct CloseFile {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// 0 or errno.
int write_all(const std::string& path, std::string_view bytes) {
  File file(std::fopen(path.c_str(), "wb"));
  if (file == nullptr) {
    return errno;
  }
  if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) {
    return errno;
  }
  return std::fclose(file.release()) == 0 ? 0 : errno;
}

void refuse_what_is_in_the_way(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw ResultError(path.string() + ": in the way: not a regular file");
  }
}

// Six decimals: finer than any of it is known, and free of binary noise for readers.
Json rounded(double value) {
  return std::round(value * 1e6) / 1e6;
}

Json rounded(const std::optional<double>& value) {
  return value.has_value() ? rounded(*value) : Json(nullptr);
}

Json to_json(const Vector3d& vector) {
  return Json::array({rounded(vector.x()), rounded(vector.y()), rounded(vector.z())});
}

Json stages_json(const std::vector<StageStats>& stages) {
  Json all = Json::object();
  for (const StageStats& stage : stages) {
    all[stage.name] = {{"count", stage.count},
                       {"mean_ms", rounded(stage.mean_ms)},
                       {"p50_ms", rounded(stage.p50_ms)},
                       {"p99_ms", rounded(stage.p99_ms)},
                       {"max_ms", rounded(stage.max_ms)}};
  }
  return all;
}

Json team_json(const std::vector<TeamMateResult>& team) {
  Json all = Json::array();
  for (const TeamMateResult& mate : team) {
    Json seen = Json::array();
    for (const VolumeAt& at : mate.seen_at) {
      seen.push_back({{"time_s", rounded(at.time_s)}, {"volume_m3", rounded(at.volume_m3)}});
    }
    all.push_back({{"id", mate.id},
                   {"is_lost", mate.is_lost},
                   {"completion_time_s", rounded(mate.completion_time_s)},
                   {"distance_m", rounded(mate.distance_m)},
                   {"speed_mean_mps", rounded(mate.speed_mean_mps)},
                   {"speed_std_mps", rounded(mate.speed_std_mps)},
                   {"seen_volume_m3", rounded(mate.seen_volume_m3)},
                   {"seen_at", std::move(seen)},
                   {"coverage", rounded(mate.coverage)},
                   {"bytes_sent", mate.bytes_sent},
                   {"bytes_per_s", rounded(mate.bytes_per_s)},
                   {"peak_bytes_per_s", mate.peak_bytes_per_s},
                   {"steady_peak_bytes_per_s", mate.steady_peak_bytes_per_s}});
  }
  return all;
}

Json scene_json(const MissionResult& result) {
  Json scene;
  scene["seed"] = result.seed;
  scene["strategy"] = result.strategy;
  scene["speed_cap"] = result.speed_cap;
  scene["scenario"] = result.scenario;
  scene["commit"] = result.commit;
  scene["vehicle_radius_m"] = rounded(result.vehicle_radius_m);
  scene["explorer_speed_mps"] = rounded(result.explorer_speed_mps);
  scene["collector_speed_mps"] = rounded(result.collector_speed_mps);
  scene["yaw_rate_limit_radps"] = rounded(result.yaw_rate_limit_radps);
  scene["box_m"] = nullptr;
  if (result.box_m.has_value()) {
    scene["box_m"] = {{"min", to_json(result.box_m->min())}, {"max", to_json(result.box_m->max())}};
  }
  scene["topview"] = nullptr;
  if (result.topview.has_value()) {
    scene["topview"] = {{"x0_m", rounded(result.topview->x0_m)},
                        {"y0_m", rounded(result.topview->y0_m)},
                        {"cell_m", rounded(result.topview->cell_m)},
                        {"width", result.topview->width},
                        {"height", result.topview->height}};
  }
  return scene;
}

}  // namespace

void prepare_result_folder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder, error)) {
    fail(folder, "cannot create the result folder", error ? error.value() : ENOTDIR);
  }
  const fs::path base(folder);
  refuse_what_is_in_the_way(base / kMapFile);
  for (const char* name : kOwnFiles) {
    refuse_what_is_in_the_way(base / name);
    fs::remove(base / name, error);
    if (error) {
      fail((base / name).string(), "cannot replace it", error.value());
    }
  }
  const std::string probe = (base / ".probe").string();
  const int error_number = write_all(probe, std::string(kProbeBytes, ' '));
  fs::remove(probe, error);
  if (error_number != 0) {
    fail(folder, "cannot write into the result folder", error_number);
  }
  const fs::space_info space = fs::space(base, error);
  if (!error && space.available < kSpaceBytes) {
    fail(folder, "cannot write into the result folder", ENOSPC);
  }
}

void write_text_file(const std::string& path, std::string_view text) {
  const std::string draft = path + ".part";
  const int error_number = write_all(draft, text);
  std::error_code error;
  if (error_number != 0) {
    fs::remove(draft, error);
    fail(path, "cannot write", error_number);
  }
  fs::rename(draft, path, error);
  if (error) {
    std::error_code ignored;
    fs::remove(draft, ignored);
    fail(path, "cannot write", error.value());
  }
}

std::string to_json(const MissionResult& result) {
  Json json;
  json["completed"] = result.completed;
  json["stop_reason"] = result.stop_reason;
  json["completion_time_s"] = rounded(result.completion_time_s);
  json["mission_time_s"] = rounded(result.mission_time_s);
  json["coverage"] = rounded(result.coverage);
  json["t50_s"] = rounded(result.t50_s);
  json["t90_s"] = rounded(result.t90_s);
  json["t95_s"] = rounded(result.t95_s);
  json["t99_s"] = rounded(result.t99_s);
  json["distance_m"] = rounded(result.distance_m);
  json["speed_mean_mps"] = rounded(result.speed_mean_mps);
  json["speed_std_mps"] = rounded(result.speed_std_mps);
  json["speed_max_mps"] = rounded(result.speed_max_mps);
  json["yaw_rate_max_radps"] = rounded(result.yaw_rate_max_radps);
  json["collisions"] = result.collisions ? Json(*result.collisions) : Json(nullptr);
  json["min_clearance_m"] = rounded(result.min_clearance_m);
  json["explored_volume_m3"] = rounded(result.explored_volume_m3);
  json["volume_at"] = Json::array();
  for (const VolumeAt& at : result.volume_at) {
    json["volume_at"].push_back(
        {{"time_s", rounded(at.time_s)}, {"volume_m3", rounded(at.volume_m3)}});
  }
  json["mode_share"] = Json::object();
  for (const auto& [mode, share] : result.mode_share) {
    json["mode_share"][mode] = rounded(share);
  }
  json["dormant_clusters"] = result.dormant_clusters;
  json["set_aside_targets"] = result.set_aside_targets;
  json["replans"] = result.replans;
  json["counters"] = Json::object();
  for (const auto& [name, count] : result.counters) {
    json["counters"][name] = count;
  }
  if (!result.team.empty()) {
    json["team"] = team_json(result.team);
    json["least_separation_m"] = rounded(result.least_separation_m);
  }
  json.update(scene_json(result));
  json["realtime_factor"] = rounded(result.realtime_factor);
  json["peak_rss_mb"] = rounded(result.peak_rss_mb);
  json["stages"] = stages_json(result.stages);
  // Text from outside that is not UTF-8 must not cost the result.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_result_json(const std::string& path, const MissionResult& result) {
  write_text_file(path, to_json(result));
}

void write_trunks(const std::string& path, const std::vector<Trunk>& trunks, const Box3d& box_m) {
  const Eigen::AlignedBox2d ground(box_m.min().head<2>(), box_m.max().head<2>());
  std::string text = "x_m,y_m,radius_m\n";
  for (const Trunk& trunk : trunks) {
    if (ground.exteriorDistance(trunk.center_m) <= trunk.radius_m) {
      fmt::format_to(std::back_inserter(text),
                     "{:.4f},{:.4f},{:.4f}\n",
                     trunk.center_m.x(),
                     trunk.center_m.y(),
                     trunk.radius_m);
    }
  }
  write_text_file(path, text);
}

Topview write_topview(const MapSnapshot& map, const std::string& path) {
  const VoxelBox& voxels = map.geometry.voxels();
  const Vector3i size = voxels.size();
  std::string text = fmt::format("P5\n{} {}\n255\n", size.x(), size.y());
  for (int y = voxels.end.y() - 1; y >= voxels.min.y(); --y) {
    for (int x = voxels.min.x(); x < voxels.end.x(); ++x) {
      int known = 0;
      bool occupied = false;
      for (int z = voxels.min.z(); z < voxels.end.z(); ++z) {
        const VoxelState state = map.state({x, y, z});
        known += state == VoxelState::kUnknown ? 0 : 1;
        occupied = occupied || state == VoxelState::kOccupied;
      }
      const int pixel = occupied ? 0 : 1 + 254 * known / size.z();
      text.push_back(static_cast<char>(static_cast<unsigned char>(pixel)));
    }
  }
  write_text_file(path, text);
  const double cell_m = map.geometry.resolution_m();
  return {voxels.min.x() * cell_m, voxels.min.y() * cell_m, cell_m, size.x(), size.y()};
}

TickWriter::TickWriter(const std::string& path, int rows_per_flush)
    : path_(path), file_(std::fopen(path.c_str(), "wb")), rows_per_flush_(rows_per_flush) {
  if (file_ == nullptr) {
    fail(path, "cannot write", errno);
  }
  buffer_ =
      "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,speed_mps,yaw_rad,yaw_rate_radps,mode,mission_state,"
      "coverage,explored_volume_m3,clusters,trails,dormant,target_id,target_x_m,target_y_m,"
      "target_z_m,clearance_m\n";
  buffered_rows_ = rows_per_flush_;  // the header goes out with the first row
}

TickWriter::~TickWriter() {
  if (file_ != nullptr) {
    flush();
  }
}

void TickWriter::append(const TickRow& row) {
  assert(file_ != nullptr);
  const auto out = std::back_inserter(buffer_);
  fmt::format_to(out,
                 "{:.3f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},",
                 row.time_s,
                 row.position_m.x(),
                 row.position_m.y(),
                 row.position_m.z(),
                 row.velocity_mps.x(),
                 row.velocity_mps.y(),
                 row.velocity_mps.z(),
                 row.velocity_mps.norm(),
                 row.yaw_rad,
                 row.yaw_rate_radps,
                 row.mode,
                 row.mission_state);
  fmt::format_to(out,
                 "{},{:.3f},{},{},{},",
                 row.coverage ? fmt::format("{:.6f}", *row.coverage) : "",
                 row.explored_volume_m3,
                 row.clusters,
                 row.trails,
                 row.dormant);
  if (row.target_id.has_value()) {
    fmt::format_to(out, "{}", *row.target_id);
  }
  if (row.target_m.has_value()) {
    const Vector3d& target_m = *row.target_m;
    fmt::format_to(out, ",{:.4f},{:.4f},{:.4f},", target_m.x(), target_m.y(), target_m.z());
  } else {
    buffer_ += ",,,,";
  }
  if (row.clearance_m.has_value()) {
    fmt::format_to(out, "{:.4f}", *row.clearance_m);
  }
  buffer_ += '\n';
  if (++buffered_rows_ >= rows_per_flush_) {
    flush();
  }
}

void TickWriter::flush() {
  const bool written =
      std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) == buffer_.size() &&
      std::fflush(file_.get()) == 0;
  if (!written && first_errno_ == 0) {
    first_errno_ = errno;
  }
  buffer_.clear();
  buffered_rows_ = 0;
}

void TickWriter::close() {
  if (file_ == nullptr) {
    return;
  }
  flush();
  if (std::fclose(file_.release()) != 0 && first_errno_ == 0) {
    first_errno_ = errno;
  }
  if (first_errno_ != 0) {
    fail(path_, "rows were lost", first_errno_);
  }
}

}  // namespace understory
