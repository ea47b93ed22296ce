// Colours and classes of a scan, through the whole program.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/scan_reader.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kCount = 4000;

// Of a ball: a colour that turns with the place.
std::array<int, 3> ColorAt(const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = p.normalized();
  return {static_cast<int>(std::lround(128 + 110 * std::sin(3 * d[0]))),
          static_cast<int>(std::lround(128 + 110 * d[1])),
          static_cast<int>(std::lround(128 - 110 * std::cos(2 * d[2])))};
}

class ColorsTest : public ProgramFixture {
 protected:
  ColorsTest() {
    std::string plain, colored = "x y z r g b intensity classification\n";
    for (int i = 0; i < kCount; ++i) {
      const double z = 1 - (i + 0.5) * 2 / kCount, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
      const Eigen::Vector3d p(r * std::cos(turn), r * std::sin(turn), z);
      const std::array<int, 3> color = ColorAt(p);
      const std::string place = absl::StrCat(p[0], " ", p[1], " ", p[2]);
      absl::StrAppend(&plain, place, "\n");
      absl::StrAppend(&colored, place, " ", color[0], " ", color[1], " ", color[2], " ",
                      0.01 * color[1], " ", i % 2 == 0 ? 2 : 5, "\n");
    }
    Write("plain.xyz", plain);
    Write("colored.csv", colored);
  }

  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(At(name), std::ios::binary) << bytes;
  }

  Json Reconstruct(const std::string& scan, const std::string& target,
                   const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"reconstruct", At(scan), "-o", At(target), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return ended.code == 0 ? Json::parse(ended.out) : Json();
  }

  // RMS of the channels of a scan's points, of 255.
  static double OffBy(const ScanFile& scan) {
    double sum = 0;
    for (Eigen::Index i = 0; i < scan.cloud.points.cols(); ++i) {
      const std::array<int, 3> color = ColorAt(scan.cloud.points.col(i));
      for (size_t k = 0; k < 3; ++k) {
        sum += std::pow(color[k] - scan.cloud.sights.colors[static_cast<size_t>(i)][k], 2);
      }
    }
    return std::sqrt(sum / (3 * static_cast<double>(scan.cloud.points.cols())));
  }
};

TEST_F(ColorsTest, ComeToTheSurfaceAndOutOfIt) {
  const Json report = Reconstruct("colored.csv", "a.dss");
  ASSERT_FALSE(report["colors"].is_null());
  EXPECT_GT(report["colors"]["bytes"], 0);
  EXPECT_LT(report["colors"]["rms"], 0.0101);
  const Json info = Json::parse(Run({"info", At("a.dss"), "--json"}).out);
  EXPECT_GT(info["color_bytes"], 0);
  EXPECT_LE(info["color_bytes"], report["colors"]["bytes"]);
  EXPECT_THAT(Run({"info", At("a.dss")}).out, HasSubstr("colours"));
  for (const char* name : {"a.ply", "a.obj"}) {
    ASSERT_EQ(Run({"export", At("a.dss"), At(name)}).code, 0);
    const auto mesh = ReadScan(At(name), {.colors = true});
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ASSERT_FALSE(mesh->cloud.sights.colors.empty()) << name;
    EXPECT_LT(OffBy(*mesh), 0.015 * 255) << name;
  }
  ASSERT_EQ(Run({"export", At("a.dss"), At("a.glb")}).code, 0);
  EXPECT_THAT(Content(At("a.glb")), HasSubstr("COLOR_0"));
  ASSERT_EQ(Run({"export", At("a.dss"), At("few.ply"), "--triangles", "500"}).code, 0);
  EXPECT_FALSE(ReadScan(At("few.ply"), {.colors = true})->cloud.sights.colors.empty());
}

TEST_F(ColorsTest, IgnoredOrAbsentTheyLeaveTheBytesAlone) {
  EXPECT_TRUE(Reconstruct("plain.xyz", "plain.dss")["colors"].is_null());
  EXPECT_TRUE(
      Reconstruct("colored.csv", "ignored.dss", {"--colors", "ignore"})["colors"].is_null());
  EXPECT_EQ(Content(At("plain.dss")), Content(At("ignored.dss")));
  ASSERT_EQ(Run({"export", At("plain.dss"), At("plain.glb")}).code, 0);
  EXPECT_THAT(Content(At("plain.glb")), Not(HasSubstr("COLOR_0")));
}

TEST_F(ColorsTest, IntensityBecomesAGrey) {
  EXPECT_FALSE(
      Reconstruct("colored.csv", "grey.dss", {"--colors", "intensity"})["colors"].is_null());
  ASSERT_EQ(Run({"export", At("grey.dss"), At("grey.ply")}).code, 0);
  const auto mesh = ReadScan(At("grey.ply"), {.colors = true});
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  for (Eigen::Index v = 0; v < mesh->cloud.points.cols(); ++v) {
    const Rgb& color = mesh->cloud.sights.colors[static_cast<size_t>(v)];
    // It grows with y, and its hundredths are black and white.
    const double grey = 127.5 * (1 + mesh->cloud.points(1, v) / 0.98);
    for (const uint8_t channel : color) ASSERT_NEAR(channel, std::clamp(grey, 0.0, 255.0), 12);
  }
  const Ended none =
      Run({"reconstruct", At("plain.xyz"), "-o", At("b.dss"), "--colors", "intensity"});
  EXPECT_EQ(none.code, 3);
  EXPECT_THAT(none.err, HasSubstr("plain.xyz: colours:"));
}

TEST_F(ColorsTest, ASizeAskedForIsKeptWithThem) {
  Reconstruct("colored.csv", "a.dss", {"--max-bytes", "1500"});
  EXPECT_LE(fs::file_size(At("a.dss")), 1500u);
  const Json info = Json::parse(Run({"info", At("a.dss"), "--json"}).out);
  EXPECT_GT(info["color_bytes"], 0);
  EXPECT_EQ(Run({"verify", At("a.dss"), At("colored.csv")}).code, 0);
}

TEST_F(ColorsTest, CarriedIntensityLeavesTheSurfaceItsColors) {
  Reconstruct("colored.csv", "a.dss");
  Write("intensity.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nproperty float intensity\nend_header\n0 0 1 7\n");
  ASSERT_EQ(Run({"export", At("a.dss"), At("own.ply")}).code, 0);
  ASSERT_EQ(Run({"export", At("a.dss"), At("b.ply"), "--carry", At("intensity.ply")}).code, 0);
  const auto own = ReadScan(At("own.ply"), {.colors = true});
  const auto carried = ReadScan(At("b.ply"), {.intensity = true, .colors = true});
  ASSERT_TRUE(own.ok() && carried.ok());
  EXPECT_EQ(carried->layers.intensity.at(0), 7);
  EXPECT_EQ(carried->cloud.sights.colors, own->cloud.sights.colors);
}

TEST_F(ColorsTest, ClassesAreChosenOrTheErrorSaysWhy) {
  const Json report = Reconstruct("colored.csv", "a.dss", {"--classes", "2"});
  EXPECT_EQ(report["points_in"], kCount / 2);
  EXPECT_EQ(Run({"verify", At("a.dss"), At("colored.csv"), "--classes", "2"}).code, 0);
  EXPECT_EQ(Reconstruct("colored.csv", "p.dss", {"--classes", "2", "--parts"})["points_in"],
            kCount / 2);
  const Ended none = Run({"reconstruct", At("plain.xyz"), "-o", At("b.dss"), "--classes", "2,6"});
  EXPECT_EQ(none.code, 3);
  EXPECT_THAT(none.err, HasSubstr("does not give each point a class"));
  const Ended other = Run({"reconstruct", At("colored.csv"), "-o", At("b.dss"), "--classes", "9"});
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.err, HasSubstr("2 (2000 points), 5 (2000 points)"));
  EXPECT_EQ(Run({"reconstruct", At("colored.csv"), "-o", At("b.dss"), "--classes", "300"}).code, 2);
}

}  // namespace
}  // namespace rilievo
