// Compressed LAS files of other programs, against the uncompressed files of the same points.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "client/formats/scan_reader.h"
#include "client/formats/trajectory.h"
#include "tests/scans/shared_folder.h"

namespace rilievo::testing {
namespace {

namespace fs = std::filesystem;

class LazSamplesTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!fs::exists(SharedFormats())) GTEST_SKIP() << "needs the samples in " << SharedFormats();
  }
};

TEST_P(LazSamplesTest, HoldsThePointsOfItsUncompressedTwin) {
  const fs::path path = SharedFormats() / GetParam();
  const WantedLayers all = {.intensity = true, .colors = true};
  const auto plain = ReadScan(path.string() + ".las", all);
  const auto packed = ReadScan(path.string() + ".laz", all);
  ASSERT_TRUE(plain.ok()) << plain.status();
  ASSERT_TRUE(packed.ok()) << packed.status();
  ASSERT_GT(plain->cloud.points.cols(), 0);
  EXPECT_TRUE(packed->cloud.points == plain->cloud.points);
  EXPECT_EQ(packed->layers.intensity, plain->layers.intensity);
  EXPECT_EQ(packed->cloud.sights.colors, plain->cloud.sights.colors);
  std::ifstream plain_in(path.string() + ".las");
  const std::vector<int64_t> counts = ReadLasScan(plain_in, {.classes = {2}})->class_counts;
  ASSERT_EQ(counts.size(), 256u);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), int64_t{0}), plain->cloud.points.cols());
  for (size_t number = 0; number < counts.size(); ++number) {
    if (counts[number] == 0) continue;
    const WantedLayers one = {.classes = {static_cast<uint8_t>(number)}};
    const auto plain_points = ReadScan(path.string() + ".las", one);
    const auto packed_points = ReadScan(path.string() + ".laz", one);
    ASSERT_TRUE(plain_points.ok() && packed_points.ok()) << packed_points.status();
    EXPECT_EQ(plain_points->cloud.points.cols(), counts[number]);
    EXPECT_TRUE(packed_points->cloud.points == plain_points->cloud.points);
  }
}

// From the time itself follows where it was, so that stations tell the times.
Trajectory Clock() {
  std::stringstream way;
  way.precision(17);
  for (double time = 0; time < 300000; time += Trajectory::kLongestGap) {
    way << time << ' ' << time << " 0 0\n";
  }
  return *Trajectory::Read(way);
}

TEST_P(LazSamplesTest, HasTheTimesOfItsUncompressedTwin) {
  const fs::path path = SharedFormats() / GetParam();
  const Trajectory clock = Clock();
  const WantedLayers wanted = {.stations = true, .trajectory = &clock};
  const auto plain = ReadScan(path.string() + ".las", wanted);
  const auto packed = ReadScan(path.string() + ".laz", wanted);
  ASSERT_EQ(packed.status().code(), plain.status().code());
  const std::string name = GetParam();
  ASSERT_EQ(plain.ok(),
            name.find("time") != name.npos || name == "autzen_trim" || name == "extrabytes");
  if (!plain.ok()) return;
  EXPECT_GT(plain->cloud.sights.stations.cols(), 1000);
  EXPECT_EQ(packed->cloud.sights.stations, plain->cloud.sights.stations);
  EXPECT_EQ(packed->cloud.sights.station_of, plain->cloud.sights.station_of);
}

INSTANTIATE_TEST_SUITE_P(OtherPrograms, LazSamplesTest,
                         ::testing::Values("1815", "autzen_trim", "extrabytes", "point-color-time",
                                           "point-color", "point-time", "point10"));

TEST(LazSampleTest, LayeredPointsOfLas14AreRead) {
  const fs::path path = SharedFormats() / "point-time-1.4.laz";
  if (!fs::exists(path)) GTEST_SKIP() << "needs " << path;
  const auto scan = ReadScan(path.string());
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_GT(scan->cloud.points.cols(), 0);
  EXPECT_TRUE(scan->cloud.points.allFinite());
}

TEST(LazSampleTest, NoPointsAreRefused) {
  const fs::path path = SharedFormats() / "no-points-1.3.laz";
  if (!fs::exists(path)) GTEST_SKIP() << "needs " << path;
  const auto scan = ReadScan(path.string());
  ASSERT_FALSE(scan.ok());
  EXPECT_THAT(std::string(scan.status().message()), ::testing::HasSubstr("0 points"));
}

// Files that laz-perf wrote, of points of a formula, in chunks of 40: of every point format that it
// knows, pointwise (0 to 3) and layered (6 to 8), some with extra bytes.
class LazFormatTest : public ::testing::TestWithParam<int> {};

TEST_P(LazFormatTest, HoldsThePointsOfTheFormula) {
  const int format = GetParam();
  const std::string name = "packed_" + std::to_string(format) + ".laz";
  const fs::path source = fs::path(__FILE__).parent_path().parent_path().parent_path();
  const auto scan =
      ReadScan((source / "fuzz/corpus/las" / name).string(), {.intensity = true, .colors = true});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->format, "LAZ 1." + std::to_string(format < 6 ? 2 : 4) + ", point format " +
                              std::to_string(format));
  ASSERT_EQ(scan->cloud.points.cols(), 100);
  ASSERT_EQ(scan->layers.intensity.size(), 100u);
  std::array<Eigen::Matrix3Xd, 3> of_class;
  for (size_t i = 0; i < 3; ++i) {
    const WantedLayers one = {.classes = {static_cast<uint8_t>(2 + i)}};
    of_class[i] = ReadScan((source / "fuzz/corpus/las" / name).string(), one)->cloud.points;
    ASSERT_EQ(of_class[i].cols(), i == 0 ? 34 : 33);
  }
  const bool colored = format == 2 || format == 3 || format >= 7;
  ASSERT_EQ(scan->cloud.sights.colors.size(), colored ? 100u : 0u);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    const int x = static_cast<int>(1000 * std::cos(.7 * i));
    const int y = static_cast<int>(1000 * std::sin(.7 * i));
    const int z = i * i % 97 * (i % 13 == 0 ? 50 : 1);
    EXPECT_EQ(scan->cloud.points(0, i), x * .01 + 1);
    EXPECT_EQ(scan->cloud.points(1, i), y * .01 + 2);
    EXPECT_EQ(scan->cloud.points(2, i), z * .01 + 3);
    EXPECT_EQ(scan->layers.intensity[i], 100 + i * 37 % 50);
    EXPECT_EQ(of_class[i % 3].col(i / 3), scan->cloud.points.col(i));
    for (int k = 0; colored && k < 3; ++k) {
      EXPECT_EQ(scan->cloud.sights.colors[i][k], (1000 * (k + 1) + i * 257 % 3000) >> 8);
    }
  }
}

// laz-perf was given point i with a time that grows, the same in all formats that have one.
TEST(LazSampleTest, TimesAreTheSamePointwiseAndLayered) {
  const fs::path source = fs::path(__FILE__).parent_path().parent_path().parent_path();
  const Trajectory clock = Clock();
  const auto sights = [&](int format) {
    const std::string name = "packed_" + std::to_string(format) + ".laz";
    const auto scan = ReadScan((source / "fuzz/corpus/las" / name).string(),
                               {.stations = true, .trajectory = &clock});
    EXPECT_TRUE(scan.ok()) << scan.status();
    return scan.ok() ? scan->cloud.sights : PointSights();
  };
  const PointSights pointwise = sights(1);
  EXPECT_GT(pointwise.stations.cols(), 10);
  for (const int format : {3, 6, 7, 8}) {
    EXPECT_EQ(sights(format).stations, pointwise.stations) << format;
    EXPECT_EQ(sights(format).station_of, pointwise.station_of) << format;
  }
}

INSTANTIATE_TEST_SUITE_P(PointFormats, LazFormatTest, ::testing::Values(0, 1, 2, 3, 6, 7, 8));

// Sizes of layers are what a file claims: points whose layer of places is empty are refused.
TEST(LazSampleTest, LayeredPointsWithoutPlacesAreRefused) {
  const fs::path source = fs::path(__FILE__).parent_path().parent_path().parent_path();
  std::ifstream in(source / "fuzz/corpus/las/packed_6.laz", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const auto number = [&](size_t at) {
    return static_cast<uint8_t>(bytes[at]) + 256u * static_cast<uint8_t>(bytes[at + 1]);
  };
  const size_t points = number(96), record = number(105);
  // The place of the chunk table, the first record, the number of points.
  bytes.replace(points + 8 + record + 4, 4, 4, '\0');
  std::istringstream damaged(bytes);
  const auto scan = ReadLasScan(damaged, {});
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(scan.status().message()),
              ::testing::HasSubstr("chunk 1, point 2 of 100: the compressed bytes end too early"));
}

// A file that ends early, anywhere, is refused and says so.
TEST(LazSampleTest, TruncatedFilesAreRefused) {
  const fs::path path = SharedFormats() / "point-color-time.laz";
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
