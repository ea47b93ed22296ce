// What the diagnosis says of scans whose truth is known.
#include <cmath>
#include <limits>
#include <numbers>

#include "client/cli/scan_diagnosis.h"
#include "tests/scans/scanner.h"
#include "tests/scans/scene.h"
#include "tests/scans/scene_scanner.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

PointCloud EvenScan(const std::string& shape, int64_t points, double noise = 0) {
  ScannerOptions options;
  options.points = points;
  options.noise = noise;
  options.views = 0;
  return SimulateScan(**MakeShape(shape), options)->cloud;
}

TEST(DiagnoseTest, CountsWhatCannotBeUsed) {
  PointCloud scan = EvenScan("sphere", 3000);
  const Eigen::Index count = scan.points.cols();
  scan.points.conservativeResize(3, count + 70);
  for (int i = 0; i < 70; ++i) scan.points.col(count + i) = scan.points.col(2 * i);
  scan.points.col(count)(1) = std::numeric_limits<double>::quiet_NaN();
  const auto diagnosis = DiagnoseScan(scan, UpDirection::kZ, {});
  ASSERT_TRUE(diagnosis.ok()) << diagnosis.status();
  EXPECT_EQ(diagnosis->points_in, 3070);
  EXPECT_EQ(diagnosis->non_finite, 1);
  EXPECT_EQ(diagnosis->duplicates, 69);
  EXPECT_THAT(diagnosis->advice, Contains(HasSubstr("lie exactly on others")));
}

TEST(DiagnoseTest, SpacingDensityAndSizeAreThoseOfTheShape) {
  // A point has 4 pi r^2 / n of a sphere's area.
  const auto diagnosis = DiagnoseScan(EvenScan("sphere", 20000), UpDirection::kZ, {});
  ASSERT_TRUE(diagnosis.ok()) << diagnosis.status();
  const double radius = diagnosis->size[0] / 2;
  const double density = 20000 / (4 * std::numbers::pi * radius * radius);
  EXPECT_NEAR(diagnosis->density[2] / density, 1, 0.15);
  EXPECT_NEAR(diagnosis->diagonal, 2 * radius * std::sqrt(3.0), 0.01 * radius);
  EXPECT_LT(diagnosis->spacing[0], diagnosis->spacing[2]);
  EXPECT_LT(diagnosis->spacing[2], diagnosis->spacing[4]);
  EXPECT_EQ(diagnosis->genus, 0);
  EXPECT_EQ(diagnosis->components, 1);
  EXPECT_TRUE(diagnosis->loop_lengths.empty());
  EXPECT_LT(diagnosis->normal_disagreement, 0.001);
}

TEST(DiagnoseTest, NoiseIsThatOfTheScanner) {
  const double noise = 0.002;
  const auto noisy = DiagnoseScan(EvenScan("torus", 30000, noise), UpDirection::kZ, {});
  ASSERT_TRUE(noisy.ok()) << noisy.status();
  EXPECT_NEAR(noisy->noise[2] / (noise * noisy->diagonal), 1, 0.4);
  EXPECT_EQ(noisy->genus, 1);
  const auto clean = DiagnoseScan(EvenScan("torus", 30000), UpDirection::kZ, {});
  EXPECT_LT(clean->noise[2], 0.1 * noisy->noise[2]);
  EXPECT_THAT(noisy->advice, Contains(HasSubstr("noisy")));
  EXPECT_THAT(clean->advice, ::testing::ElementsAre(HasSubstr("No problems found")));
}

TEST(DiagnoseTest, AHoleIsMeasured) {
  PointCloud scan = EvenScan("sphere", 20000);
  const double radius = scan.points.row(2).maxCoeff();
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < scan.points.cols(); ++i) {
    if (scan.points(2, i) < 0.6 * radius) scan.points.col(kept++) = scan.points.col(i);
  }
  scan.points.conservativeResize(3, kept);
  const auto diagnosis = DiagnoseScan(scan, UpDirection::kZ, {});
  ASSERT_TRUE(diagnosis.ok()) << diagnosis.status();
  ASSERT_EQ(diagnosis->loop_lengths.size(), 1u);
  // The rim's radius is 0.8 of the sphere's.
  EXPECT_NEAR(diagnosis->loop_lengths[0] / (2 * std::numbers::pi * 0.8 * radius), 1, 0.1);
  EXPECT_THAT(diagnosis->advice, Contains(HasSubstr("--boundary close")));
}

PointCloud SeenScene(const Scene& scene) { return ScanScene(scene, {.points = 4000})->cloud; }

TEST(DiagnoseTest, StationsTellTheSetting) {
  const PointCloud block = SeenScene(MakeBlock()), street = SeenScene(MakeStreet());
  PointCloud rooms = SeenScene(MakeRooms());
  EXPECT_EQ(SettingOf(block, UpDirection::kZ), ScanSetting::kAbove);
  EXPECT_EQ(SettingOf(street, UpDirection::kZ), ScanSetting::kGround);
  EXPECT_EQ(SettingOf(rooms, UpDirection::kUnknown), ScanSetting::kIndoors);
  EXPECT_EQ(SettingOf(block, UpDirection::kX), ScanSetting::kUnknown) << "few points each";
  PointCloud table = street;
  table.sights.stations.colwise() = Eigen::Vector3d(0, -100, 1);
  EXPECT_EQ(SettingOf(table, UpDirection::kZ), ScanSetting::kUnknown) << "all ahead";

  const ScanDiagnosis diagnosis = DiagnoseScan(rooms, UpDirection::kZ, {}).value();
  EXPECT_THAT(DiagnosisText(diagnosis), HasSubstr("indoors or underground, by 3 stations\n"));
  rooms.sights.stations.setZero();
  rooms.sights.stations.row(2).setConstant(1000);
  const ScanDiagnosis wrong = DiagnoseScan(rooms, UpDirection::kZ, {}).value();
  EXPECT_THAT(DiagnosisText(wrong), HasSubstr("3 stations, not believed\n"));
  EXPECT_THAT(wrong.advice, Contains(HasSubstr("The stations of the scan contradict")));

  rooms.sights = {};
  EXPECT_EQ(SettingOf(rooms, UpDirection::kZ), ScanSetting::kUnknown);
}

using DiagnoseProgramTest = ProgramFixture;

TEST_F(DiagnoseProgramTest, SaysWhatThenHappens) {
  ASSERT_EQ(Run({"simulate", "genus2", "-o", At("a.ply"), "--points", "20000"}).code, 0);
  const Ended text = Run({"diagnose", At("a.ply")});
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_LE(WidestLine(text.out.substr(text.out.find('\n'))), 80u) << text.out;
  EXPECT_THAT(text.out, HasSubstr("arbitrary"));
  const Ended ended = RunPiped(Content(At("a.ply")), {"diagnose", "-", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const Json said = Json::parse(ended.out);
  const Ended made = Run({"reconstruct", At("a.ply"), "-o", At("a.dss"), "--quiet", "--json"});
  const Json happened = Json::parse(made.out);
  for (const char* same : {"points_used", "road", "components", "genus", "duplicates"}) {
    EXPECT_EQ(said[same], happened[same]) << same;
  }
  EXPECT_EQ(said["control_faces"], happened["control_faces"]);
  EXPECT_LT(said["expected_bytes"][0], happened["encoded_bytes"]);
  EXPECT_GT(said["expected_bytes"][1], happened["encoded_bytes"]);
}

TEST_F(DiagnoseProgramTest, ForetellsTheFacesUnderNoise) {
  for (const std::string noise : {"0", "0.002"}) {
    ASSERT_EQ(
        Run({"simulate", "sphere", "-o", At("a.ply"), "--points", "20000", "--noise", noise}).code,
        0);
    const Json said = Json::parse(Run({"diagnose", At("a.ply"), "--json"}).out);
    const Json made =
        Json::parse(Run({"reconstruct", At("a.ply"), "-o", At("a.dss"), "--quiet", "--json"}).out);
    EXPECT_EQ(said["control_faces"], made["control_faces"]) << noise;
    // All 666 of one for thirty points, or a fifth.
    EXPECT_EQ(int{said["control_faces"]} < 300, noise != "0") << said["control_faces"];
    EXPECT_LT(said["expected_bytes"][0], made["encoded_bytes"]);
    EXPECT_GT(said["expected_bytes"][1], made["encoded_bytes"]);
  }
}

TEST_F(DiagnoseProgramTest, OutliersAreLeftOutUnlessTheyAreToBeKept) {
  std::ofstream out(At("a.xyz"));
  constexpr int kPoints = 1500;
  for (int i = 0; i < kPoints; ++i) {
    const double z = -1 + (2.0 * i + 1) / kPoints, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
    out << r * std::cos(turn) << ' ' << r * std::sin(turn) << ' ' << z << '\n';
  }
  out << "0.8 0.8 0.8\n";
  out.close();
  for (const std::string outliers : {"remove", "keep"}) {
    const Json made = Json::parse(Run({"reconstruct", At("a.xyz"), "-o", At("a.dss"), "--quiet",
                                       "--json", "--max-level", "1", "--outliers", outliers})
                                      .out);
    EXPECT_EQ(made["outliers"], outliers == "keep" ? 0 : 1);
    EXPECT_EQ(made["points_used"], outliers == "keep" ? kPoints + 1 : kPoints);
  }
}

TEST_F(DiagnoseProgramTest, WhatIsNoSurfaceIsSaidInWords) {
  std::ofstream line(At("line.xyz"));
  for (int i = 0; i < 100; ++i) line << i << " 0 0\n";
  line.close();
  const Ended ended = Run({"diagnose", At("line.xyz")});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("line.xyz: "));
}

}  // namespace
}  // namespace rilievo
