// Stations and normals in the formats that hold them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "client/formats/scan_reader.h"
#include "tests/unit/formats/e57_file.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kIdentity;
using testing::PtxCloud;

constexpr WantedLayers kBoth = {.stations = true, .normals = true};

absl::StatusOr<ScanFile> Read(const std::string& bytes, const std::string& name,
                              const WantedLayers& wanted = kBoth) {
  std::istringstream in(bytes);
  return ReadScanStream(in, name, wanted);
}

PointSights SightsIn(const std::string& bytes, const std::string& name,
                     const WantedLayers& wanted = kBoth) {
  const auto scan = Read(bytes, name, wanted);
  EXPECT_TRUE(scan.ok()) << scan.status();
  if (!scan.ok()) return {};
  EXPECT_TRUE(CheckSights(scan->cloud.sights, scan->cloud.points.cols()).ok());
  return scan->cloud.sights;
}

void ExpectNone(const PointSights& sights) {
  EXPECT_EQ(sights.stations.cols(), 0);
  EXPECT_THAT(sights.station_of, IsEmpty());
  EXPECT_EQ(sights.normals.cols(), 0);
}

Eigen::Matrix3Xd Columns(std::initializer_list<Eigen::Vector3d> columns) {
  Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(columns.size()));
  Eigen::Index next = 0;
  for (const Eigen::Vector3d& column : columns) matrix.col(next++) = column;
  return matrix;
}

TEST(SightsTest, PtxHasItsRegisteredPositions) {
  // The position that the matrix gives where the line of the position holds zeros.
  const std::string moved = "1 0 0 0\n0 1 0 0\n0 0 1 0\n10 20 30 1\n";
  const std::string file = PtxCloud(2, 1, kIdentity, "1 2 3 0.5\n0 0 0 0\n") +
                           PtxCloud(2, 1, moved, "1 0 0 0.1\n2 0 0 0.1\n");
  const PointSights sights = SightsIn(file, "a.ptx");
  EXPECT_EQ(sights.stations, Columns({{0, 0, 0}, {10, 20, 30}}));
  EXPECT_THAT(sights.station_of, ElementsAre(0, 1, 1));
  const std::string named =
      "2\n1\n7 8 9\n1 0 0\n0 1 0\n0 0 1\n" + std::string(kIdentity) + "1 2 3 0.5\n4 5 6 0.5\n";
  EXPECT_EQ(SightsIn(named, "a.ptx").stations, Columns({{7, 8, 9}}));
  ExpectNone(SightsIn(file, "a.ptx", {}));
}

testing::E57Scan E57Points(const char* x, const char* y, const char* z, std::string more) {
  testing::E57Scan scan = {.records = 2, .more = std::move(more)};
  scan.columns = {testing::E57Reals(x, false, {1, 2}), testing::E57Reals(y, false, {.5, .25}),
                  testing::E57Reals(z, false, {.125, 0})};
  return scan;
}

TEST(SightsTest, E57NormalsAreTurnedByThePose) {
  // A quarter turn about z: x becomes y.
  const std::string pose =
      "<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">"
      "0.70710678118654752</w><x type=\"Float\"/><y type=\"Float\"/>"
      "<z type=\"Float\">0.70710678118654752</z></rotation></pose>";
  testing::E57Scan with = E57Points("cartesianX", "cartesianY", "cartesianZ", pose);
  with.columns.push_back(testing::E57Reals("nor:normalX", true, {1, 0}));
  with.columns.push_back(testing::E57Reals("nor:normalY", true, {0, 0.5}));
  with.columns.push_back(testing::E57Reals("nor:normalZ", false, {0, 0.25}));
  with.columns.push_back(testing::E57Integers("classification", 0, 7, {2, 6}));
  const testing::E57Scan without = E57Points("cartesianX", "cartesianY", "cartesianZ", "");
  const Eigen::Matrix3Xf normals = SightsIn(testing::E57File({with, without}), "a.e57").normals;
  ASSERT_EQ(normals.cols(), 4);
  EXPECT_LT((normals.col(0) - Eigen::Vector3f(0, 1, 0)).norm(), 1e-6f);
  EXPECT_LT((normals.col(1) - Eigen::Vector3f(-0.5f, 0, 0.25f)).norm(), 1e-6f);
  EXPECT_TRUE(normals.col(2).array().isNaN().all());
  EXPECT_EQ(SightsIn(testing::E57File({without}), "a.e57").normals.cols(), 0);
  EXPECT_EQ(SightsIn(testing::E57File({with}), "a.e57", {.stations = true}).normals.cols(), 0);
  WantedLayers ground = kBoth;
  ground.classes = {6};
  EXPECT_LT((SightsIn(testing::E57File({with}), "a.e57", ground).normals.col(0) -
             Eigen::Vector3f(-0.5f, 0, 0.25f))
                .norm(),
            1e-6f);
}

TEST(SightsTest, E57HasTheOriginOfEachScan) {
  const auto pose = [](const std::string& x) {
    return "<pose type=\"Structure\"><translation type=\"Structure\"><x type=\"Float\">" + x +
           "</x><y type=\"Float\">2</y><z type=\"Float\">3</z></translation></pose>";
  };
  const char *x = "cartesianX", *y = "cartesianY", *z = "cartesianZ";
  const char *range = "sphericalRange", *azimuth = "sphericalAzimuth",
             *elevation = "sphericalElevation";
  const PointSights sights =
      SightsIn(testing::E57File({E57Points(x, y, z, pose("5")), E57Points(x, y, z, ""),
                                 E57Points(range, azimuth, elevation, ""),
                                 E57Points(range, azimuth, elevation, pose("-5"))}),
               "a.e57");
  EXPECT_EQ(sights.stations, Columns({{5, 2, 3}, {0, 0, 0}, {-5, 2, 3}}));
  EXPECT_THAT(sights.station_of, ElementsAre(0, 0, kNoStation, kNoStation, 1, 1, 2, 2));
  ExpectNone(SightsIn(testing::E57File({E57Points(x, y, z, "")}), "a.e57"));
}

TEST(SightsTest, PcdHasAViewpointOrColumns) {
  const auto file = [](const std::string& viewpoint) {
    return "VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\n"
           "TYPE F F F F F F\nWIDTH 2\nHEIGHT 1\n" +
           viewpoint + "POINTS 2\nDATA ascii\n1 2 3 0 0 1\n4 5 6 0 -1 nan\n";
  };
  const PointSights sights = SightsIn(file("VIEWPOINT 7 8 9.5 1 0 0 0\n"), "a.pcd");
  EXPECT_EQ(sights.stations, Columns({{7, 8, 9.5}}));
  EXPECT_THAT(sights.station_of, ElementsAre(0, 0));
  ASSERT_EQ(sights.normals.cols(), 2);
  EXPECT_EQ(sights.normals.col(0), Eigen::Vector3f(0, 0, 1));
  EXPECT_THAT(SightsIn(file("VIEWPOINT 0 0 0 1 0 0 0\n"), "a.pcd").station_of, IsEmpty())
      << "the default of the format";
  for (const char* line : {"VIEWPOINT 7 8 1 0 0 0\n", "VIEWPOINT 7 8 x 1 0 0 0\n"}) {
    EXPECT_THAT(std::string(Read(file(line), "a.pcd").status().message()),
                ::testing::AllOf(HasSubstr("VIEWPOINT"), HasSubstr("7 numbers")));
    ExpectNone(SightsIn(file(line), "a.pcd", {}));
  }
}

TEST(SightsTest, PlyHasColumnsOrAnElement) {
  const std::string columns =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float nz\nproperty float x\n"
      "property float y\nproperty float z\nproperty float nx\nproperty float ny\n"
      "property double sensor_x\nproperty double sensor_y\nproperty double sensor_z\nend_header\n"
      "1 1 2 3 0 0 0.1 8 9\n0 4 5 6 0 1 nan 8 9\n";
  const PointSights sights = SightsIn(columns, "a.ply");
  EXPECT_EQ(sights.stations, Columns({{0.1, 8, 9}}));
  EXPECT_THAT(sights.station_of, ElementsAre(0, kNoStation));
  ASSERT_EQ(sights.normals.cols(), 2);
  EXPECT_EQ(sights.normals.col(0), Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(sights.normals.col(1), Eigen::Vector3f(0, 1, 0));

  const std::string vertex =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property int station\n";
  const std::string station =
      "element station 2\nproperty double x\nproperty double y\nproperty double z\n";
  const std::string points = "1 2 3 1\n4 5 6 -1\n7 8 9 0\n", places = "0.1 0 0\n5 5 5\n";
  const std::string head = "ply\nformat ascii 1.0\n";
  for (const std::string& file : {head + vertex + station + "end_header\n" + points + places,
                                  head + station + vertex + "end_header\n" + places + points}) {
    const PointSights numbered = SightsIn(file, "a.ply");
    EXPECT_EQ(numbered.stations, Columns({{5, 5, 5}, {0.1, 0, 0}}));
    EXPECT_THAT(numbered.station_of, ElementsAre(0, kNoStation, 1));
    ExpectNone(SightsIn(file, "a.ply", {}));
  }
  const std::string beyond =
      head + vertex + station + "end_header\n1 2 3 1\n4 5 6 2\n7 8 9 0\n" + places;
  EXPECT_THAT(std::string(Read(beyond, "a.ply").status().message()),
              ::testing::AllOf(HasSubstr("'vertex' 1"), HasSubstr("2 is not one of 2 stations")));
  const std::string flat =
      head + "element station 1\nproperty float x\n" + vertex + "end_header\n1\n" + points;
  EXPECT_THAT(std::string(Read(flat, "a.ply").status().message()), HasSubstr("'y'"));
  const std::string claim = head +
                            "element station 4000000000\nproperty float x\n"
                            "property float y\nproperty float z\n" +
                            vertex + "end_header\n1 1 1\n";
  EXPECT_EQ(Read(claim, "a.ply").status().code(), absl::StatusCode::kDataLoss);
}

TEST(SightsTest, TextHasColumnsThatAHeadingNames) {
  const std::string file =
      "Nx, Ny, Nz, X, Y, Z, i, sensor_x, sensor_y, sensor_z\n"
      "0, 0, 1, 1, 2, 3, 9, 7, 8, 9\n0, 1, 0, 4, 5, 6, 9\n";
  const PointSights sights = SightsIn(file, "a.csv");
  EXPECT_EQ(sights.stations, Columns({{7, 8, 9}}));
  EXPECT_THAT(sights.station_of, ElementsAre(0, kNoStation)) << "a short line does not say";
  ASSERT_EQ(sights.normals.cols(), 2);
  EXPECT_EQ(sights.normals.col(0), Eigen::Vector3f(0, 0, 1));
  ExpectNone(SightsIn("1 2 3 0 0 1\n4 5 6 0 0 1\n", "a.xyz"));
  EXPECT_THAT(std::string(Read("x y z nx ny nz\n1 2 3 0 zero 1\n", "a.xyz").status().message()),
              ::testing::AllOf(HasSubstr("line 2"), HasSubstr("'zero'")));
}

}  // namespace
}  // namespace rilievo
