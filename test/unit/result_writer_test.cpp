// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/result_writer.hpp"

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

namespace understory {
namespace {

namespace fs = std::filesystem;

// An empty folder of its own for each test, gone afterwards.
class ResultFolder : public testing::Test {
 protected:
  void SetUp() override {
    const char* test = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / ("understory_" + std::to_string(getpid()) + "_" + test);
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] const fs::path& folder() const { return folder_; }
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
  }

 private:
  fs::path folder_;
};

using PrepareResultFolder = ResultFolder;
using ResultJson = ResultFolder;
using Ticks = ResultFolder;
using TopviewFile = ResultFolder;

// Makes every write beyond `bytes` fail, as a full disk does.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : old_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    (void)getrlimit(RLIMIT_FSIZE, &old_limit_);
    const rlimit limit{bytes, old_limit_.rlim_max};
    (void)setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  FileSizeLimit(FileSizeLimit&&) = delete;
  FileSizeLimit& operator=(FileSizeLimit&&) = delete;
  ~FileSizeLimit() {
    (void)setrlimit(RLIMIT_FSIZE, &old_limit_);
    (void)std::signal(SIGXFSZ, old_handler_);
  }

 private:
  rlimit old_limit_{};
  void (*old_handler_)(int);
};

template <class Action>
std::string error_of(const Action& action) {
  try {
    action();
  } catch (const ResultError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(PrepareResultFolder, CreatesNestedFoldersAndLeavesNothingInThem) {
  prepare_result_folder(path("a/b/c"));

  EXPECT_TRUE(fs::is_directory(path("a/b/c")));
  EXPECT_TRUE(fs::is_empty(path("a/b/c")));
}

TEST_F(PrepareResultFolder, FileInTheWayOfTheFolderIsNamed) {
  put("taken", "");

  EXPECT_EQ(error_of([&] { prepare_result_folder(path("taken")); }),
            path("taken") + ": cannot create the result folder: Not a directory");
  EXPECT_EQ(error_of([&] { prepare_result_folder(path("taken/below")); }),
            path("taken/below") + ": cannot create the result folder: Not a directory");
}

TEST_F(PrepareResultFolder, FolderInTheWayOfAFileIsNamed) {
  fs::create_directories(path("ticks.csv/full"));

  EXPECT_EQ(error_of([&] { prepare_result_folder(folder()); }),
            path("ticks.csv") + ": in the way: not a regular file");
}

TEST_F(PrepareResultFolder, FolderThatTakesNoFilesIsFoundAtStart) {
  EXPECT_THAT(error_of([] { prepare_result_folder("/proc"); }),
              testing::StartsWith("/proc: cannot write into the result folder: "));
  EXPECT_THAT(error_of([] { prepare_result_folder("/proc/understory"); }),
              testing::StartsWith("/proc/understory: cannot create the result folder: "));
}

TEST_F(PrepareResultFolder, FullDiskIsFoundAtStartAndTheProbeIsGone) {
  std::string error;
  {
    const FileSizeLimit limit(10000);
    error = error_of([&] { prepare_result_folder(folder()); });
  }

  EXPECT_EQ(error, folder().string() + ": cannot write into the result folder: File too large");
  EXPECT_TRUE(fs::is_empty(folder()));
}

TEST_F(PrepareResultFolder, EarlierResultsGoAndTheMapAndForeignFilesStay) {
  put("result.json", "{}");
  put("report.html", "old");
  put("map.ot", "map");
  put("notes.txt", "mine");

  prepare_result_folder(folder());

  EXPECT_FALSE(fs::exists(path("result.json")));
  EXPECT_FALSE(fs::exists(path("report.html")));
  EXPECT_EQ(content("map.ot"), "map");
  EXPECT_EQ(content("notes.txt"), "mine");
}

TEST_F(ResultJson, HoldsEveryPromisedKeyInAFixedOrder) {
  MissionResult result;
  result.completed = true;
  result.stop_reason = "nothing left";
  result.completion_time_s = 451.2;
  result.mission_time_s = 470.5;
  result.coverage = 0.1 + 0.2;
  result.collisions = 0;
  result.t50_s = 120.0;
  result.min_clearance_m = 0.31;
  result.volume_at = {{100.0, 1200.5}};
  result.mode_share = {{"explorer", 0.75}, {"collector", 0.25}};
  result.counters = {{"braked", 2}};
  result.seed = 18446744073709551615U;
  result.strategy = "explorer_collector";
  result.speed_cap = "paper";
  result.scenario = "small";
  result.commit = "abc";
  result.explorer_speed_mps = 1.5;
  result.box_m = Box3d(Vector3d(-10.0, -10.0, 0.0), Vector3d(10.0, 10.0, 2.0));
  result.topview = Topview{-10.0, -10.0, 0.1, 200, 200};
  result.realtime_factor = 25.0;
  result.peak_rss_mb = 90.0;
  result.stages = {{"map", 2, 1.5, 1.0, 2.0, 2.0}};

  const auto json = nlohmann::ordered_json::parse(to_json(result));

  std::string compact = json.dump();
  EXPECT_EQ(compact,
            "{\"completed\":true,\"stop_reason\":\"nothing left\",\"completion_time_s\":451.2,"
            "\"mission_time_s\":470.5,\"coverage\":0.3,\"t50_s\":120.0,\"t90_s\":null,"
            "\"t95_s\":null,\"t99_s\":null,\"distance_m\":0.0,\"speed_mean_mps\":0.0,"
            "\"speed_std_mps\":0.0,\"speed_max_mps\":0.0,\"yaw_rate_max_radps\":0.0,"
            "\"collisions\":0,\"min_clearance_m\":0.31,\"explored_volume_m3\":0.0,"
            "\"volume_at\":[{\"time_s\":100.0,\"volume_m3\":1200.5}],"
            "\"mode_share\":{\"collector\":0.25,\"explorer\":0.75},\"dormant_clusters\":0,"
            "\"set_aside_targets\":0,\"replans\":0,\"counters\":{\"braked\":2},"
            "\"seed\":18446744073709551615,\"strategy\":\"explorer_collector\","
            "\"speed_cap\":\"paper\",\"scenario\":\"small\",\"commit\":\"abc\","
            "\"vehicle_radius_m\":0.2,\"explorer_speed_mps\":1.5,\"collector_speed_mps\":null,"
            "\"yaw_rate_limit_radps\":null,"
            "\"box_m\":{\"min\":[-10.0,-10.0,0.0],\"max\":[10.0,10.0,2.0]},"
            "\"topview\":{\"x0_m\":-10.0,\"y0_m\":-10.0,\"cell_m\":0.1,\"width\":200,"
            "\"height\":200},\"realtime_factor\":25.0,\"peak_rss_mb\":90.0,"
            "\"stages\":{\"map\":{\"count\":2,\"mean_ms\":1.5,\"p50_ms\":1.0,\"p99_ms\":2.0,"
            "\"max_ms\":2.0}}}");
}

TEST_F(ResultJson, NumbersThatAreNotFiniteAndTextThatIsNotUtf8StillMakeValidJson) {
  MissionResult result;
  result.speed_mean_mps = std::numeric_limits<double>::quiet_NaN();
  result.min_clearance_m = std::numeric_limits<double>::infinity();
  result.scenario = "forest\xff.csv";

  const auto json = nlohmann::json::parse(to_json(result));

  EXPECT_TRUE(json["speed_mean_mps"].is_null());
  EXPECT_TRUE(json["min_clearance_m"].is_null());
}

TEST_F(ResultJson, FullDiskKeepsTheEarlierFileAndNamesTheNewOne) {
  put("result.json", "earlier");
  MissionResult result;
  result.stop_reason = std::string(50000, 'x');
  std::string error;
  {
    const FileSizeLimit limit(10000);
    error = error_of([&] { write_result_json(path("result.json"), result); });
  }

  EXPECT_EQ(error, path("result.json") + ": cannot write: File too large");
  EXPECT_EQ(content("result.json"), "earlier");
  EXPECT_FALSE(fs::exists(path("result.json.part")));
}

TEST_F(ResultJson, TrunksOutsideTheBoxAreLeftOut) {
  const Box3d box(Vector3d(-5.0, -5.0, 0.0), Vector3d(5.0, 5.0, 2.0));

  write_trunks(path("trunks.csv"),
               {{{1.0, 2.0}, 0.25}, {{5.1, 0.0}, 0.2}, {{5.3, 0.0}, 0.2}, {{-9.0, 0.0}, 0.3}},
               box);

  EXPECT_EQ(content("trunks.csv"),
            "x_m,y_m,radius_m\n1.0000,2.0000,0.2500\n5.1000,0.0000,0.2000\n");
}

TickRow full_row() {
  TickRow row;
  row.time_s = 12.0666667;
  row.position_m = {1.0, -2.5, 1.00004};
  row.velocity_mps = {0.3, 0.4, 0.0};
  row.yaw_rad = 3.14159;
  row.yaw_rate_radps = -0.9;
  row.mode = "collector";
  row.mission_state = "explore";
  row.coverage = 0.123456789;
  row.explored_volume_m3 = 617.25;
  row.clusters = 41;
  row.trails = 7;
  row.dormant = 2;
  row.target_id = 99;
  row.target_m = Vector3d(4.0, 5.0, 1.0);
  row.clearance_m = 0.61234;
  return row;
}

constexpr const char* kHeader =
    "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,speed_mps,yaw_rad,yaw_rate_radps,mode,mission_state,"
    "coverage,explored_volume_m3,clusters,trails,dormant,target_id,target_x_m,target_y_m,"
    "target_z_m,clearance_m\n";

TEST_F(Ticks, AreWrittenWithFixedPrecision) {
  TickWriter writer(path("ticks.csv"));
  writer.append(full_row());
  TickRow bare;
  bare.mode = "explorer";
  bare.mission_state = "take_off";
  writer.append(bare);
  writer.close();

  EXPECT_EQ(content("ticks.csv"),
            std::string(kHeader) +
                "12.067,1.0000,-2.5000,1.0000,0.3000,0.4000,0.0000,0.5000,3.1416,-0.9000,"
                "collector,explore,0.123457,617.250,41,7,2,99,4.0000,5.0000,1.0000,0.6123\n"
                "0.000,0.0000,0.0000,0.0000,0.0000,0.0000,0.0000,0.0000,0.0000,0.0000,"
                "explorer,take_off,,0.000,0,0,0,,,,,\n");
}

TEST_F(Ticks, MissionWithoutTicksLeavesTheHeader) {
  TickWriter(path("ticks.csv")).close();

  EXPECT_EQ(content("ticks.csv"), kHeader);
}

TEST_F(Ticks, AtMostSixtyFourRowsAreNotOnDiskWhileFlying) {
  TickWriter writer(path("ticks.csv"));

  for (int i = 0; i < 1000; ++i) {
    writer.append(full_row());
  }

  const std::string so_far = content("ticks.csv");
  EXPECT_GE(std::count(so_far.begin(), so_far.end(), '\n'), 1 + 1000 - 64);
}

TEST_F(Ticks, WriterThatIsDroppedOnTheWayOutLosesNothing) {
  {
    TickWriter writer(path("ticks.csv"));
    for (int i = 0; i < 70; ++i) {
      writer.append(full_row());
    }
  }

  const std::string text = content("ticks.csv");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 71);
}

TEST_F(Ticks, RowsLostToAFullDiskAreReportedAtTheEndNotInFlight) {
  TickWriter writer("/dev/full");
  EXPECT_NO_THROW(writer.append(full_row()));

  EXPECT_EQ(error_of([&] { writer.close(); }),
            "/dev/full: rows were lost: No space left on device");
}

TEST_F(Ticks, FileThatCannotBeOpenedIsNamed) {
  EXPECT_EQ(error_of([&] { TickWriter writer(path("none/ticks.csv")); }),
            path("none/ticks.csv") + ": cannot write: No such file or directory");
}

TEST_F(TopviewFile, ShowsOccupiedUnknownAndPartlyKnownColumnsNorthUp) {
  const GridGeometry geometry(0.5, Box3d(Vector3d(-1.0, 0.0, 0.0), Vector3d(1.0, 1.0, 1.0)));
  MapSnapshot map{geometry, SensorModel(SensorModelConfig{}), 0, {}, {}, {}};
  map.tiles.resize(geometry.slot_count());
  auto tile = std::make_shared<Tile>();
  const auto set = [&](const VoxelIndex& voxel, std::int8_t log_odds) {
    tile->log_odds[offset_in_tile(voxel)] = log_odds;
  };
  // Of the eastern half (x = 0, 1), which is one tile: (0, 0) is known throughout, (1, 0) up to
  // half its height, (0, 1) holds a hit. The western half is another tile: unknown.
  set({0, 0, 0}, -20);
  set({0, 0, 1}, -20);
  set({1, 0, 0}, -20);
  set({0, 1, 0}, 127);
  map.tiles[geometry.slot_of({0, 0, 0})] = tile;

  const Topview topview = write_topview(map, path("topview.pgm"));

  const std::string pixels = {'\x01',
                              '\x01',
                              '\x00',
                              '\x01',  // y = 1: north
                              '\x01',
                              '\x01',
                              '\xff',
                              '\x80'};  // y = 0
  EXPECT_EQ(content("topview.pgm"), "P5\n4 2\n255\n" + pixels);
  EXPECT_EQ(topview.width, 4);
  EXPECT_EQ(topview.height, 2);
  EXPECT_DOUBLE_EQ(topview.x0_m, -1.0);
  EXPECT_DOUBLE_EQ(topview.y0_m, 0.0);
  EXPECT_DOUBLE_EQ(topview.cell_m, 0.5);
}

TEST(StageTimes, PercentilesAreSamplesThatOccurred) {
  StageTimes times;
  const StageTimes::Stage map = times.stage("map");
  const StageTimes::Stage idle = times.stage("idle");
  for (int i = 100; i >= 1; --i) {
    times.add(map, std::chrono::milliseconds(i));
  }

  const std::vector<StageStats> stats = times.stats();

  EXPECT_EQ(times.stage("map"), map);
  EXPECT_NE(idle, map);
  ASSERT_EQ(stats.size(), 2U);
  EXPECT_EQ(stats[0].name, "map");
  EXPECT_EQ(stats[0].count, 100U);
  EXPECT_DOUBLE_EQ(stats[0].mean_ms, 50.5);
  EXPECT_DOUBLE_EQ(stats[0].p50_ms, 50.0);
  EXPECT_DOUBLE_EQ(stats[0].p99_ms, 99.0);
  EXPECT_DOUBLE_EQ(stats[0].max_ms, 100.0);
  EXPECT_EQ(stats[1].count, 0U);
}

TEST(StageTimes, TimerAddsOneSamplePerScope) {
  StageTimes times;
  const StageTimes::Stage stage = times.stage("work");
  { const StageTimer timer(times, stage); }
  { const StageTimer timer(times, stage); }

  EXPECT_EQ(times.stats()[0].count, 2U);
  EXPECT_GE(times.stats()[0].max_ms, times.stats()[0].p50_ms);
}

TEST(StageTimes, PeakMemoryIsThatOfARunningProcess) {
  EXPECT_GT(peak_rss_mb(), 1.0);
  EXPECT_LT(peak_rss_mb(), 100000.0);
}

}  // namespace
}  // namespace understory
