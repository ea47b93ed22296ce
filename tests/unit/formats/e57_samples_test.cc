// E57 files of other programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>

#include "client/formats/scan_reader.h"
#include "tests/scans/shared_folder.h"

namespace rilievo::testing {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;

class E57SamplesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(SharedFormats())) GTEST_SKIP() << "needs the samples in " << SharedFormats();
  }

  static absl::StatusOr<ScanFile> Read(const std::string& name) {
    return ReadScan((SharedFormats() / (name + ".e57")).string(),
                    {.intensity = true, .colors = true});
  }
};

TEST_F(E57SamplesTest, IntegersHoldThePointsOfTheReals) {
  const auto reals = Read("bunnyDouble");
  ASSERT_TRUE(reals.ok()) << reals.status();
  ASSERT_EQ(reals->cloud.points.cols(), 30571);
  for (const char* name : {"bunnyInt19", "bunnyInt24"}) {
    const auto integers = Read(name);
    ASSERT_TRUE(integers.ok()) << integers.status();
    ASSERT_EQ(integers->cloud.points.cols(), 30571);
    EXPECT_LE((integers->cloud.points - reals->cloud.points).cwiseAbs().maxCoeff(), 1e-6) << name;
  }
}

TEST_F(E57SamplesTest, SingleHoldsThePointsOfDouble) {
  const auto reals = Read("ColouredCubeDouble"), singles = Read("ColouredCubeFloat");
  ASSERT_TRUE(reals.ok()) << reals.status();
  ASSERT_TRUE(singles.ok()) << singles.status();
  ASSERT_EQ(reals->cloud.points.cols(), 7680);
  EXPECT_LE((singles->cloud.points - reals->cloud.points).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_EQ(singles->cloud.sights.colors, reals->cloud.sights.colors);
}

// A unit sphere, every second point of it invalid.
TEST_F(E57SamplesTest, SphericalPointsLieOnTheirSphere) {
  const auto scan = Read("tiny_spherical");
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->cloud.points.cols(), 180);
  EXPECT_LE((scan->cloud.points.colwise().norm().array() - 1).abs().maxCoeff(), 1e-15);
}

TEST_F(E57SamplesTest, OtherFilesAreRead) {
  const std::pair<const char*, int> expected[] = {{"cartesian_invalid_state_single", 1},
                                                  {"las2e57_no_images_tag", 153},
                                                  {"read_error", 2651},
                                                  {"scaled_integer_intensity", 2},
                                                  {"tinyCartesianFloatRgb", 2090},
                                                  {"tiny_pc_and_images", 2},
                                                  {"tiny_pc_with_extension", 1}};
  for (const auto& [name, count] : expected) {
    const auto scan = Read(name);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_EQ(scan->cloud.points.cols(), count) << name;
  }
  EXPECT_EQ(Read("cartesian_invalid_state_single")->cloud.points.col(0),
            Eigen::Vector3d(-1, -2, -3));
  EXPECT_EQ(Read("scaled_integer_intensity")->cloud.points.col(1), Eigen::Vector3d(4.4, 5.5, 6.6));
}

TEST_F(E57SamplesTest, DamagedAndEmptyFilesAreRefused) {
  const std::pair<const char*, const char*> expected[] = {{"corrupt_crc", "page at byte 33792"},
                                                          {"bad-crc", "page at byte 0"},
                                                          {"empty", "no scan"},
                                                          {"empty_pc", "0 points"},
                                                          {"ZeroPoints", "0 points"},
                                                          {"ZeroPointsInvalid", "0 points"},
                                                          {"InvalidCVHeader", "0 points"}};
  for (const auto& [name, part] : expected) {
    const auto scan = Read(name);
    ASSERT_FALSE(scan.ok()) << name;
    EXPECT_THAT(std::string(scan.status().message()), HasSubstr(part));
  }
}

}  // namespace
}  // namespace rilievo::testing
