// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest_csv.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"
#include "understory/sim/forest_generator.hpp"

namespace understory {
namespace {

using testing::HasSubstr;

std::string error_of_file(const std::string& path) {
  try {
    (void)read_forest_csv(path);
  } catch (const ForestError& error) {
    return error.what();
  }
  return "no error";
}

std::string error_of(const std::string& content) {
  const TemporaryFolder folder;
  return error_of_file(folder.write("stand.csv", content));
}

Forest forest_of(const std::string& content) {
  const TemporaryFolder folder;
  return read_forest_csv(folder.write("stand.csv", content));
}

TEST(ForestCsv, ReadsRadiiAfterAComment) {
  const Forest forest = forest_of("# anything\n-21.8803,7.5470,0.2941\n 1 , +2.5e0,\t0.1\r\n");

  ASSERT_EQ(forest.trunks.size(), 2U);
  EXPECT_EQ(forest.trunks[0].center_m, Vector2d(-21.8803, 7.5470));
  EXPECT_EQ(forest.trunks[0].radius_m, 0.2941);
  EXPECT_EQ(forest.trunks[1].center_m, Vector2d(1.0, 2.5));
  EXPECT_EQ(forest.trunks[1].radius_m, 0.1);
  EXPECT_EQ(forest.trunk_height_m, 3.0);
}

TEST(ForestCsv, ReadsDiametersAfterTheHeader) {
  const Forest forest = forest_of("x_m,y_m,dbh_m\n-1.950,30.520,0.091\n");

  ASSERT_EQ(forest.trunks.size(), 1U);
  EXPECT_EQ(forest.trunks[0].center_m, Vector2d(-1.950, 30.520));
  EXPECT_EQ(forest.trunks[0].radius_m, 0.0455);
}

TEST(ForestCsv, ToleratesByteOrderMarkWindowsLinesBlankLinesAndNoLastNewline) {
  const Forest forest =
      forest_of("\xEF\xBB\xBFx_m, y_m, dbh_m\r\n\r\n1,2,0.4\r\n# note\r\n3,4,0.4");

  ASSERT_EQ(forest.trunks.size(), 2U);
  EXPECT_EQ(forest.trunks[1].center_m, Vector2d(3, 4));
}

TEST(ForestCsv, RefusesFilesThatAreNoStemMaps) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_of_file(folder.path_of("absent.csv")),
              AllOf(HasSubstr("absent.csv"), HasSubstr("cannot be opened")));
  EXPECT_THAT(error_of_file(folder.path_of("")), HasSubstr("is a folder"));
  EXPECT_THAT(error_of(""), HasSubstr("is empty"));
  EXPECT_THAT(error_of("\n\n  \n"), HasSubstr("is empty"));
  EXPECT_THAT(error_of("# only a comment\n"), HasSubstr("holds no trunk"));
  EXPECT_THAT(error_of("x_m,y_m,dbh_m\n"), HasSubstr("holds no trunk"));
  EXPECT_THAT(error_of(std::string("# a\n1,2,0\0.3\n", 13)), HasSubstr("zero bytes"));
}

TEST(ForestCsv, RefusesAWrongHeaderAndSaysWhatItExpects) {
  for (const char* first : {"x,y,radius",
                            "x_m,y_m,radius_m",
                            "y_m,x_m,dbh_m",
                            "x_m,y_m",
                            "1,2,0.3",
                            "x_m;y_m;dbh_m",
                            "X_M,Y_M,DBH_M",
                            "x_m,y_m,dbh_m,species"}) {
    EXPECT_THAT(error_of(std::string(first) + "\n1,2,0.3\n"),
                AllOf(HasSubstr("stand.csv:1: "), HasSubstr("x_m,y_m,dbh_m")))
        << first;
  }
}

TEST(ForestCsv, NamesTheLineOfARowWithTooFewOrTooManyColumns) {
  EXPECT_THAT(error_of("# c\n1,2,0.3\n1,2\n"), HasSubstr("stand.csv:3: fewer than three"));
  EXPECT_THAT(error_of("# c\n1,2,0.3\n1"), HasSubstr("stand.csv:3: fewer than three"));
  EXPECT_THAT(error_of("# c\n1,2,0.3,\n"), HasSubstr("stand.csv:2: more than three"));
  EXPECT_THAT(error_of("x_m,y_m,dbh_m\n\n1,2,3,4\n"), HasSubstr("stand.csv:3: more than three"));
  EXPECT_THAT(error_of("# c\n1;2;0.3\n"), HasSubstr("stand.csv:2: fewer than three"));
}

TEST(ForestCsv, RefusesEverythingThatIsNotAFiniteNumber) {
  for (const char* bad : {"",
                          "nan",
                          "NaN",
                          "-nan",
                          "inf",
                          "-Infinity",
                          "1e999",
                          "abc",
                          "0x10",
                          "1.0 2.0",
                          "1.0m",
                          "--1",
                          "1e",
                          "\"1\"",
                          ".",
                          "1.2.3",
                          "1_000"}) {
    EXPECT_THAT(error_of(std::string("# c\n1,2,0.3\n") + bad + ",2,0.3\n"),
                HasSubstr("stand.csv:3: x is not a number"))
        << bad;
    EXPECT_THAT(error_of(std::string("# c\n1,") + bad + ",0.3\n"),
                HasSubstr("stand.csv:2: y is not a number"))
        << bad;
    EXPECT_THAT(error_of(std::string("x_m,y_m,dbh_m\n1,2,") + bad + "\n"),
                HasSubstr("stand.csv:2: dbh_m is not a number"))
        << bad;
  }
}

TEST(ForestCsv, RefusesImpossibleTrunks) {
  EXPECT_THAT(error_of("# c\n1,2,0\n"), HasSubstr("stand.csv:2: the trunk's size is not positive"));
  EXPECT_THAT(error_of("# c\n1,2,-0.3\n"), HasSubstr("not positive"));
  EXPECT_THAT(error_of("x_m,y_m,dbh_m\n1,2,-0.3\n"), HasSubstr("not positive"));
  EXPECT_THAT(error_of("# c\n1,2,5.01\n"), HasSubstr("stand.csv:2: the trunk's radius is above"));
  EXPECT_THAT(error_of("x_m,y_m,dbh_m\n1,2,10.1\n"), HasSubstr("above 5 m"));
  EXPECT_THAT(error_of("# c\n100001,2,0.3\n"), HasSubstr("stand.csv:2: farther than 100 km"));
  EXPECT_THAT(error_of("# c\n1,-1e300,0.3\n"), HasSubstr("farther than 100 km"));
  EXPECT_EQ(error_of("x_m,y_m,dbh_m\n1,2,9.9\n"), "no error");
}

TEST(ForestCsv, SurvivesEveryTruncationOfAGoodFile) {
  const std::string good = "x_m,y_m,dbh_m\n-1.950,30.520,0.091\n0.537,26.000,0.059\n";
  for (std::size_t length = 0; length < good.size(); ++length) {
    const std::string error = error_of(good.substr(0, length));
    // Only a cut inside the last digits of a row leaves something that is a stem map by itself.
    if (error == "no error") {
      EXPECT_GT(length, good.find("0.091")) << length;
    } else {
      EXPECT_THAT(error, HasSubstr("stand.csv")) << length;
    }
  }
}

TEST(ForestCsv, SurvivesRandomBytes) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Rng rng(seed);
    std::string text = "# c\n1,2,0.3\n-4,5.5,0.2\n";
    for (int i = 0; i < 3; ++i) {
      text[rng.below(text.size())] = static_cast<char>(rng.below(256));
    }

    const std::string error = error_of(text);

    EXPECT_TRUE(error == "no error" || error.find("stand.csv") != std::string::npos)
        << "seed " << seed << ": " << error;
  }
}

TEST(ForestCsv, GivesBackTheVeryForestThatWasGeneratedAndWritten) {
  const TemporaryFolder folder;
  const Forest forest = generate_forest(GeneratorConfig{}, Rng(9));

  write_forest_csv(forest, folder.path_of("forest.csv"));
  const Forest read = read_forest_csv(folder.path_of("forest.csv"));

  ASSERT_EQ(read.trunks.size(), forest.trunks.size());
  for (std::size_t i = 0; i < read.trunks.size(); ++i) {
    EXPECT_EQ(read.trunks[i].center_m, forest.trunks[i].center_m);
    EXPECT_EQ(read.trunks[i].radius_m, forest.trunks[i].radius_m);
  }
}

TEST(ForestCsv, ReadsThePublicForestsWhereTheyAreThere) {
  const std::filesystem::path folder =
      std::filesystem::path(UNDERSTORY_SOURCE_DIR) / ".." / "shared" / "forests";
  if (!std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << folder << " is not there";
  }

  EXPECT_EQ(read_forest_csv(folder / "synthetic" / "forest_d020_s3.csv").trunks.size(), 500U);
  EXPECT_EQ(read_forest_csv(folder / "rainier" / "rainier_AV02.csv").trunks.size(), 1388U);
  for (const char* stand : {"AB08", "AG05", "AV02", "PP17", "TO11"}) {
    const Forest forest =
        read_forest_csv(folder / "rainier" / (std::string("rainier_") + stand + ".csv"));
    const Forest scene = centered_crop(forest, {Vector2d(30, 30), Vector2d(70, 70)});
    const Box2d box_m(Vector2d(-20, -20), Vector2d(20, 20));

    EXPECT_GT(scene.trunks.size(), 20U) << stand;
    EXPECT_TRUE(nearest_clear_point(scene, box_m, {0, 0}, 1.0).has_value()) << stand;
  }
}

TEST(ForestCsv, SaysSoWhenItCannotWrite) {
  const TemporaryFolder folder;
  const std::string path = folder.path_of("absent/forest.csv");
  try {
    write_forest_csv(Forest{}, path);
    FAIL() << "wrote into a folder that does not exist";
  } catch (const ForestError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(path), HasSubstr("cannot be written")));
  }
}

}  // namespace
}  // namespace understory
