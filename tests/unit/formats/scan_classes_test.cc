// Points of a scan that are chosen by their classes or returns, whatever its format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/scan_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo::testing {
namespace {

constexpr int kClassed = 60;

// `byte_of`: what the byte at `at` of each point is.
template <typename ByteOf>
std::string ChangedLas(int format, size_t at, const ByteOf& byte_of) {
  const Eigen::Matrix3Xd points = SpherePoints(kClassed);
  const int minor = format < 6 ? 2 : 4;
  std::string file = LasFile(points, {.minor = minor, .point_format = format});
  const size_t size = format < 6 ? 20 : 30;
  const size_t begin = file.size() - size * kClassed;
  for (int i = 0; i < kClassed; ++i) {
    file[begin + size * static_cast<size_t>(i) + at] = static_cast<char>(byte_of(i));
  }
  return file;
}

std::string ClassedLas(int format) {
  return ChangedLas(format, format < 6 ? 15 : 16, [](int i) {
    return i % 3 == 0 ? 2 : i % 3 == 1 ? 5 : 6;
  });
}

struct CollectedPoints : PointSink {
  absl::Status Expect(uint64_t count) override {
    expected += count;
    return absl::OkStatus();
  }
  absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& block) override {
    points.conservativeResize(3, points.cols() + block.cols());
    points.rightCols(block.cols()) = block;
    return absl::OkStatus();
  }
  uint64_t expected = 0;
  Eigen::Matrix3Xd points{3, 0};
};

TEST(ScanClassesTest, OnlyPointsOfThemAreRead) {
  const Eigen::Matrix3Xd points = SpherePoints(kClassed);
  std::string csv = "x,y,z,classification,r,g,b,intensity\n";
  std::string ply = PlyHeaderText("ascii", absl::StrCat(kClassed),
                                  "property float x\nproperty float y\nproperty float z\n"
                                  "property float scalar_Classification\n");
  for (int i = 0; i < kClassed; ++i) {
    const int number = i % 3 == 0 ? 2 : i % 3 == 1 ? 5 : 6;
    absl::StrAppend(&csv, points(0, i), ",", points(1, i), ",", points(2, i), ",", number, ",", i,
                    ",0,0,", 256 * i, "\n");
    absl::StrAppend(&ply, points(0, i), " ", points(1, i), " ", points(2, i), " ", number, "\n");
  }
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"a.las", ClassedLas(0)}, {"b.las", ClassedLas(6)}, {"c.csv", csv}, {"d.ply", ply}}) {
    std::istringstream in(bytes);
    const auto scan =
        ReadScanStream(in, name, {.intensity = true, .colors = true, .classes = {2, 6}});
    ASSERT_TRUE(scan.ok()) << name << ": " << scan.status();
    ASSERT_EQ(scan->cloud.points.cols(), 40) << name;
    EXPECT_NEAR((scan->cloud.points.col(1) - points.col(2)).norm(), 0, 1e-5) << name;
    if (name == "c.csv") {
      EXPECT_EQ(scan->cloud.sights.colors[1], (Rgb{2, 0, 0}));
    }
    if (!scan->layers.intensity.empty()) {
      EXPECT_EQ(scan->layers.intensity[1], 512);
    }
    EXPECT_EQ(scan->layers.intensity.empty(), name == "d.ply");

    CollectedPoints sink;
    std::istringstream again(bytes);
    const auto passed = ReadScanStream(again, name, {.classes = {2, 6}, .sink = &sink});
    ASSERT_TRUE(passed.ok()) << name << ": " << passed.status();
    EXPECT_EQ(sink.points, scan->cloud.points) << name;
    EXPECT_EQ(sink.expected, 0u) << "how many are chosen is not known";
    EXPECT_EQ(passed->format, scan->format);
  }
}

TEST(ScanClassesTest, AllOfThemReachASinkInBlocks) {
  constexpr int kRows = 150'000;
  std::string csv = "x,y,z,classification\n";
  for (int i = 0; i < kRows; ++i) absl::StrAppend(&csv, i, ",0,0,", i % 7 < 4 ? 2 : 5, "\n");
  std::istringstream in(csv), again(csv);
  const auto scan = ReadScanStream(in, "a.csv", {.classes = {2}});
  CollectedPoints sink;
  const auto passed = ReadScanStream(again, "a.csv", {.classes = {2}, .sink = &sink});
  ASSERT_TRUE(passed.ok()) << passed.status();
  EXPECT_GT(sink.points.cols(), kRows / 2);
  EXPECT_EQ(sink.points, scan->cloud.points);
}

// How bright a colour is does not depend on which points are taken.
TEST(ScanClassesTest, ColorsAreScaledByThoseOfTheFile) {
  const std::string csv =
      "x,y,z,classification,r,g,b\n0,0,0,2,256,512,256\n1,0,0,5,65535,65535,65535\n";
  std::istringstream in(csv);
  const auto scan = ReadScanStream(in, "a.csv", {.colors = true, .classes = {2}});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->cloud.sights.colors, (std::vector<Rgb>{{1, 2, 1}}));
  EXPECT_EQ(scan->format, "text, columns x, y, z, 1 of 2 points by class");
}

constexpr char kLine[] = "0 0 0 1 2 3\n";

TEST(ScanClassesTest, WithoutThemTheErrorSaysWhatThereIs) {
  std::istringstream las(ClassedLas(0)), xyz(kLine);
  EXPECT_THAT(ReadScanStream(las, "a.las", {.classes = {9}}).status().message(),
              ::testing::HasSubstr("there are 2 (20 points), 5 (20 points), 6 (20 points)"));
  const auto none = ReadScanStream(xyz, "a.xyz", {.classes = {2}}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(none));
  EXPECT_THAT(none.message(), ::testing::HasSubstr("does not give each point a class"));
  CollectedPoints sink;
  std::istringstream las_again(ClassedLas(6)), xyz_again(kLine);
  EXPECT_THAT(
      ReadScanStream(las_again, "a.las", {.classes = {9}, .sink = &sink}).status().message(),
      ::testing::HasSubstr("there are 2 (20 points), 5 (20 points), 6 (20 points)"));
  EXPECT_EQ(ReadScanStream(xyz_again, "a.xyz", {.classes = {2}, .sink = &sink}).status(), none);
  EXPECT_EQ(sink.points.cols(), 0);
}

TEST(ScanReturnsTest, OnlyTheLastOfAPulseAreRead) {
  for (const int format : {0, 6}) {
    const int bits = format < 6 ? 3 : 4;
    const auto returns = [&](int i) { return i == 0 ? 0 : (i % 3 + 1) | 3 << bits; };
    std::istringstream in(ChangedLas(format, 14, returns));
    const auto scan = ReadScanStream(in, "a.las", {.last_returns = true});
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_EQ(scan->cloud.points.cols(), 21);  // one has no numbers
    EXPECT_NEAR((scan->cloud.points.col(1) - SpherePoints(kClassed).col(2)).norm(), 0, 1e-5);
    EXPECT_THAT(scan->format, ::testing::HasSubstr("without 39 returns before the last"));
  }
}

}  // namespace
}  // namespace rilievo::testing
