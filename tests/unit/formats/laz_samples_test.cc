// Compressed LAS files of other programs, against the uncompressed files of the same points.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "client/formats/scan_reader.h"

namespace rilievo::testing {
namespace {

namespace fs = std::filesystem;

fs::path SampleFolder() {
  if (const char* named = std::getenv("RILIEVO_SHARED")) return fs::path(named) / "data/formats";
  fs::path source = __FILE__;
  for (int i = 0; i < 5; ++i) source = source.parent_path();
  return source / "shared/data/formats";
}

class LazSamplesTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!fs::exists(SampleFolder())) GTEST_SKIP() << "needs the samples in " << SampleFolder();
  }
};

TEST_P(LazSamplesTest, HoldsThePointsOfItsUncompressedTwin) {
  const fs::path path = SampleFolder() / GetParam();
  const WantedLayers all = {.intensity = true, .colors = true};
  const auto plain = ReadScan(path.string() + ".las", all);
  const auto packed = ReadScan(path.string() + ".laz", all);
  ASSERT_TRUE(plain.ok()) << plain.status();
  ASSERT_TRUE(packed.ok()) << packed.status();
  ASSERT_GT(plain->cloud.points.cols(), 0);
  EXPECT_TRUE(packed->cloud.points == plain->cloud.points);
  EXPECT_EQ(packed->layers.intensity, plain->layers.intensity);
  EXPECT_EQ(packed->layers.colors, plain->layers.colors);
}

INSTANTIATE_TEST_SUITE_P(OtherPrograms, LazSamplesTest,
                         ::testing::Values("1815", "autzen_trim", "extrabytes", "point-color-time",
                                           "point-color", "point-time", "point10"));

TEST(LazSampleTest, LayeredPointsOfLas14AreRead) {
  const fs::path path = SampleFolder() / "point-time-1.4.laz";
  if (!fs::exists(path)) GTEST_SKIP() << "needs " << path;
  const auto scan = ReadScan(path.string());
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_GT(scan->cloud.points.cols(), 0);
  EXPECT_TRUE(scan->cloud.points.allFinite());
}

TEST(LazSampleTest, NoPointsAreRefused) {
  const fs::path path = SampleFolder() / "no-points-1.3.laz";
  if (!fs::exists(path)) GTEST_SKIP() << "needs " << path;
  const auto scan = ReadScan(path.string());
  ASSERT_FALSE(scan.ok());
  EXPECT_THAT(std::string(scan.status().message()), ::testing::HasSubstr("0 points"));
}

// A file that ends early, anywhere, is refused and says so.
TEST(LazSampleTest, TruncatedFilesAreRefused) {
  const fs::path path = SampleFolder() / "point-color-time.laz";
  if (!fs::exists(path)) GTEST_SKIP() << "needs " << path;
  std::ifstream in(path, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  for (size_t size = 300; size < whole.size() / 2; size += 251) {
    std::istringstream part(whole.substr(0, size));
    EXPECT_FALSE(ReadLasScan(part).ok()) << size << " of " << whole.size() << " bytes";
  }
}

}  // namespace
}  // namespace rilievo::testing
