#include "core/pipeline/options_text.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(OptionsTextTest, NothingAskedForIsNoText) { EXPECT_EQ(OptionsText({}, 0), ""); }

TEST(OptionsTextTest, PartsAreTold) {
  EXPECT_EQ(OptionsText({}, 7, PartSizes{}), "seed=7 made=parts");
  EXPECT_EQ(ReadOptionsText("seed=7 made=parts")->parts->part_points, PartSizes{}.part_points);
  EXPECT_FALSE(ReadOptionsText("seed=7")->parts);
  const std::string smaller = OptionsText({}, 0, PartSizes::Of(2048));
  EXPECT_EQ(smaller, "made=parts part_sizes=8192/2048/1024");
  EXPECT_EQ(ReadOptionsText(smaller)->parts->block_vertices, 1024);
  EXPECT_FALSE(ReadOptionsText("made=parts part_sizes=8192/2048").ok());
}

TEST(OptionsTextTest, WhatWasAskedForIsNamed) {
  ReconstructOptions options;
  options.encode.max_error = 0.0003;
  options.max_level = 0;
  options.control.boundary = BoundaryRule::kClose;
  options.fit.method = FitMethod::kSuzuki;
  EXPECT_EQ(OptionsText(options, 7),
            "boundary=close method=suzuki max_error=3e-04 max_level=0 seed=7");
}

TEST(OptionsTextTest, EveryNumberComesBackAsItWas) {
  ReconstructOptions options;
  options.check.duplicate_distance = 1.0 / 3e8;
  options.scan.neighbors.k = 24;
  options.scan.outliers.distance_factor = 0;
  options.control.topology = Topology::kPlanar;
  options.control.target_faces = 500;
  options.control.creases = CreaseRule::kAuto;
  options.displacement.min_normal_agreement = -0.1;
  options.encode.max_bytes = int64_t{1} << 40;
  const std::string text = OptionsText(options, uint64_t{1} << 63);
  const auto read = ReadOptionsText(text);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->options.check.duplicate_distance, options.check.duplicate_distance);
  EXPECT_EQ(read->options.scan.neighbors.k, 24);
  EXPECT_EQ(read->options.scan.outliers.distance_factor, 0);
  EXPECT_EQ(read->options.control.topology, Topology::kPlanar);
  EXPECT_EQ(read->options.control.target_faces, 500);
  EXPECT_EQ(read->options.control.creases, CreaseRule::kAuto);
  EXPECT_EQ(read->options.displacement.min_normal_agreement, -0.1);
  EXPECT_EQ(read->options.encode.max_bytes, int64_t{1} << 40);
  EXPECT_FALSE(read->options.encode.max_error.has_value());
  EXPECT_EQ(read->seed, uint64_t{1} << 63);
  EXPECT_EQ(OptionsText(read->options, read->seed), text);
}

TEST(OptionsTextTest, OptionsOfEarlierVersionsAreReadAndMeanNothing) {
  const auto read = ReadOptionsText("neighbors=24 smoothing_rounds=0 max_queue=40");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(OptionsText(read->options, read->seed), "neighbors=24");
}

TEST(OptionsTextTest, UnknownWordsAndBrokenNumbersAreNamed) {
  for (const char* text :
       {"neighbors=24 color=red", "color", "neighbors=2x4", "topology=flat", "max_error=", "=3"}) {
    const auto read = ReadOptionsText(text);
    EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
  EXPECT_NE(ReadOptionsText("neighbors=24 color=red").status().message().find("color=red"),
            absl::string_view::npos);
}

}  // namespace
}  // namespace rilievo
