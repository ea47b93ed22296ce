#include "core/pipeline/enough_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace rilievo {
namespace {

using ::testing::ElementsAre;

struct EnoughPointsTest : ::testing::Test {
  ReconstructOptions options;
  double few_error = 3e-4, most_error = 5e-5;
  std::vector<int64_t> asked;

  // The RMS error of what is kept.
  double Kept(int64_t triangles) {
    asked.clear();
    const auto made = WithEnoughPoints(triangles, options, [&](int64_t points) {
      Reconstruction reconstruction;
      reconstruction.report.max_error = options.encode.max_error.value_or(0);
      reconstruction.report.error.rms = asked.empty() ? few_error : most_error;
      reconstruction.report.error.across_rms = reconstruction.report.error.rms / 2;
      asked.push_back(points);
      return absl::StatusOr<Reconstruction>(std::move(reconstruction));
    });
    EXPECT_TRUE(made.ok()) << made.status();
    return made->report.error.rms;
  }
};

TEST_F(EnoughPointsTest, TwiceAsManyWhereTheSurfaceIsNotExactEnough) {
  EXPECT_EQ(Kept(10), 5e-5);
  EXPECT_THAT(asked, ElementsAre(100'000, 200'000));
  EXPECT_EQ(Kept(1'000'000), 3e-4);
  EXPECT_THAT(asked, ElementsAre(250'000));
  most_error = 4e-4;
  EXPECT_EQ(Kept(150'000), 3e-4) << "the nearer one";
  EXPECT_THAT(asked, ElementsAre(150'000, 250'000));
  few_error = 9e-5;
  EXPECT_EQ(Kept(10), 9e-5);
  EXPECT_THAT(asked, ElementsAre(100'000));
}

TEST_F(EnoughPointsTest, AnErrorAskedForCounts) {
  options.encode.max_error = 2e-4;  // across the surface: 1.5e-4
  EXPECT_EQ(Kept(10), 3e-4);
  options.encode.max_error = 1e-4;
  EXPECT_EQ(Kept(10), 5e-5);
}

TEST_F(EnoughPointsTest, WhatIsGivenStays) {
  options.max_level = 2;
  EXPECT_EQ(Kept(10), 3e-4);
  options.max_level.reset();
  options.encode.max_bytes = 1000;
  EXPECT_EQ(Kept(10), 3e-4);
  options.encode.max_bytes.reset();
  options.control.target_faces = 500;
  EXPECT_EQ(Kept(10), 3e-4);
}

}  // namespace
}  // namespace rilievo
