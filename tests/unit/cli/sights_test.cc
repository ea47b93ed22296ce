// Scans that tell where they were seen from, or give normals, through the whole program.
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_reader.h"
#include "core/points/point_index.h"
#include "tests/scans/scene_scanner.h"
#include "tests/unit/cli/program_fixture.h"
#include "tests/unit/formats/e57_file.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class SightsTest : public ProgramFixture {
 protected:
  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(At(name), std::ios::binary) << bytes;
  }

  Json Reconstruct(const std::string& scan, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"reconstruct", At(scan), "-o", At("a.ply"), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return ended.code == 0 ? Json::parse(ended.out) : Json();
  }

  // Share of the surface's area that faces the station of the point next to it.
  double FacingStations(const PointCloud& scan) const {
    const TriangleMesh mesh = ReadMesh(At("a.ply"))->mesh;
    const PointIndex index(scan.points);
    double facing = 0, area = 0;
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
      const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, f)),
                            b = mesh.vertices.col(mesh.triangles(1, f)),
                            c = mesh.vertices.col(mesh.triangles(2, f));
      const Eigen::Vector3d normal = (b - a).cross(c - a), middle = (a + b + c) / 3;
      int nearest = 0;
      double squared = 0;
      index.Nearest(middle, 1, &nearest, &squared);
      const auto station = scan.sights.stations.col(scan.sights.station_of[nearest]);
      area += normal.norm();
      if (normal.dot(station - middle) > 0) facing += normal.norm();
    }
    return facing / area;
  }
};

// Each station in coordinates of its own, turned and moved.
std::string PtxFile(const PointCloud& scan) {
  std::string file;
  for (Eigen::Index s = 0; s < scan.sights.stations.cols(); ++s) {
    const Eigen::Vector3d place = scan.sights.stations.col(s);
    const auto count = std::count(scan.sights.station_of.begin(), scan.sights.station_of.end(), s);
    absl::StrAppend(&file, count, "\n1\n", place.x(), " ", place.y(), " ", place.z(),
                    "\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n", place.x(), " ",
                    place.y(), " ", place.z(), " 1\n");
    for (Eigen::Index i = 0; i < scan.points.cols(); ++i) {
      if (scan.sights.station_of[i] != s) continue;
      const Eigen::Vector3d way = scan.points.col(i) - place;
      absl::StrAppend(&file, way.y(), " ", -way.x(), " ", way.z(), " 0.5\n");
    }
  }
  return file;
}

// Spherical coordinates, the place of each station as its pose.
std::string E57OfStations(const PointCloud& scan) {
  std::vector<testing::E57Scan> scans;
  for (Eigen::Index s = 0; s < scan.sights.stations.cols(); ++s) {
    const Eigen::Vector3d place = scan.sights.stations.col(s);
    std::vector<double> range, azimuth, elevation;
    for (Eigen::Index i = 0; i < scan.points.cols(); ++i) {
      if (scan.sights.station_of[i] != s) continue;
      const Eigen::Vector3d way = scan.points.col(i) - place;
      range.push_back(way.norm());
      azimuth.push_back(std::atan2(way.y(), way.x()));
      elevation.push_back(std::asin(way.z() / way.norm()));
    }
    testing::E57Scan& one = scans.emplace_back();
    one.records = range.size();
    one.columns = {testing::E57Reals("sphericalRange", false, range),
                   testing::E57Reals("sphericalAzimuth", false, azimuth),
                   testing::E57Reals("sphericalElevation", false, elevation)};
    one.more = absl::StrCat("<pose type=\"Structure\"><translation type=\"Structure\">",
                            "<x type=\"Float\">", place.x(), "</x><y type=\"Float\">", place.y(),
                            "</y><z type=\"Float\">", place.z(), "</z></translation></pose>");
  }
  return testing::E57File(scans);
}

TEST_F(SightsTest, RoomsInPtxAndE57FaceTheirStations) {
  const PointCloud rooms = ScanScene(MakeRooms(), {.points = 30'000})->cloud;
  Write("rooms.ptx", PtxFile(rooms));
  Write("rooms.e57", E57OfStations(rooms));
  for (const char* name : {"rooms.ptx", "rooms.e57"}) {
    const Json report = Reconstruct(name);
    EXPECT_GT(report["stations"]["points"], 29'500) << "all but outliers";
    EXPECT_EQ(report["stations"]["used"], true);
    EXPECT_GT(FacingStations(rooms), 0.99) << name;
  }
  EXPECT_TRUE(Reconstruct("rooms.ptx", {"--stations", "ignore"})["stations"].is_null());
  EXPECT_LT(FacingStations(rooms), 0.9) << "what there is to gain";
}

// A sphere with its normals and a sensor at (8, 0, 0), as text.
std::string Sphere(double side, bool with_sensor) {
  std::string text =
      absl::StrCat("x y z nx ny nz", with_sensor ? " sensor_x sensor_y sensor_z" : "", "\n");
  constexpr int kCount = 2000;
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - (i + 0.5) * 2 / kCount, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
    const double x = r * std::cos(turn), y = r * std::sin(turn);
    absl::StrAppend(&text, x, " ", y, " ", z, " ", side * x, " ", side * y, " ", side * z,
                    with_sensor ? " 8 0 0" : "", "\n");
  }
  return text;
}

TEST_F(SightsTest, FlippedNormalsTurnTheSurfaceInsideOut) {
  const auto volume = [&] {
    const TriangleMesh mesh = ReadMesh(At("a.ply"))->mesh;
    double sum = 0;
    for (const auto corners : mesh.triangles.colwise()) {
      sum += mesh.vertices.col(corners[0])
                 .dot(mesh.vertices.col(corners[1]).cross(mesh.vertices.col(corners[2]))) /
             6;
    }
    return sum;
  };
  const double kBall = 4.0 / 3 * 3.14159;
  for (const double side : {1.0, -1.0}) {
    Write("sphere.xyz", Sphere(side, false));
    EXPECT_EQ(Reconstruct("sphere.xyz")["normals"]["used"], true);
    EXPECT_NEAR(volume(), side * kBall, 0.02 * kBall);
    Reconstruct("sphere.xyz", {"--normals", "ignore"});
    EXPECT_NEAR(volume(), kBall, 0.02 * kBall);
  }
}

// A LAS 1.2 file of a unit ball of 2000 points, the i-th at the time i / 100.
std::string BallOfTimes() {
  constexpr int kCount = 2000;
  std::string header(227, '\0'), records;
  const auto put = [&](size_t at, auto value) {
    header.replace(at, sizeof value, LowBytesFirst(value));
  };
  header.replace(0, 4, "LASF");
  put(24, uint8_t{1});
  put(25, uint8_t{2});
  put(94, uint16_t{227});
  put(96, uint32_t{227});
  put(104, uint8_t{1});
  put(105, uint16_t{28});
  put(107, uint32_t{kCount});
  for (const size_t axis : {0, 1, 2}) put(131 + 8 * axis, 1e-6);
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - (i + 0.5) * 2 / kCount, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
    for (const double value : {r * std::cos(turn), r * std::sin(turn), z}) {
      records += LowBytesFirst(static_cast<int32_t>(std::lround(value * 1e6)));
    }
    records += std::string(8, '\0') + LowBytesFirst(i / 100.0);
  }
  return header + records;
}

TEST_F(SightsTest, ATrajectoryTellsWhereLasPointsWereSeenFrom) {
  Write("ball.las", BallOfTimes());
  Write("way.csv", "time,x,y,z\n0,-0.1,0,0\n10,0.1,0,0\n20,0.1,0.1,0\n");
  const auto at_top = [&] {  // which way the surface faces there
    const TriangleMesh mesh = ReadMesh(At("a.ply"))->mesh;
    Eigen::Index top;
    mesh.vertices.row(2).maxCoeff(&top);
    return mesh.normals(2, top);
  };
  EXPECT_TRUE(Reconstruct("ball.las")["stations"].is_null());
  EXPECT_GT(at_top(), 0.9);
  const Json report = Reconstruct("ball.las", {"--trajectory", At("way.csv")});
  EXPECT_EQ(report["stations"]["used"], true);
  EXPECT_EQ(report["stations"]["points"], 2000);
  EXPECT_LT(at_top(), -0.9) << "seen from within";
  Write("points.csv", "x,y,z\n0,0,0\n");
  for (const auto& [scan, way, part] :
       {std::tuple("points.csv", "way.csv", "GPS times"),
        std::tuple("ball.las", "points.csv", "trajectory: line 1"),
        std::tuple("ball.las", "none.csv", "none.csv: cannot be read")}) {
    const Ended refused =
        Run({"reconstruct", At(scan), "-o", At("b.dss"), "--trajectory", At(way)});
    EXPECT_NE(refused.code, 0);
    EXPECT_THAT(refused.err, HasSubstr(part));
  }
  EXPECT_EQ(Run({"reconstruct", At("ball.las"), "-o", At("b.dss"), "--trajectory", At("way.csv"),
                 "--report", At("way.csv")})
                .code,
            2);
}

TEST_F(SightsTest, WhatIsNotBelievedIsSaid) {
  Write("sphere.xyz", Sphere(1, true));
  const Json report = Reconstruct("sphere.xyz");
  EXPECT_EQ(report["stations"]["used"], false);
  EXPECT_EQ(report["normals"]["used"], true);
  ASSERT_EQ(report["warnings"].size(), 1u);
  EXPECT_THAT(report["warnings"][0].get<std::string>(), HasSubstr("--stations use"));
  const Ended text = Run({"reconstruct", At("sphere.xyz"), "-o", At("a.dss")});
  EXPECT_THAT(text.out, HasSubstr("stations of 2,000 points, not believed"));
}

TEST_F(SightsTest, RulesThatAreNoneAreRefused) {
  EXPECT_EQ(Run({"reconstruct", "a.ply", "-o", "b.dss", "--stations", "trust"}).code, 2);
  EXPECT_EQ(Run({"reconstruct", "a.ply", "-o", "b.dss", "--normals", "flip"}).code, 2);
  std::string plain;
  for (int i = 0; i < 30; ++i) absl::StrAppend(&plain, i % 5, " ", i / 5, " 0\n");
  Write("plain.xyz", plain);
  const Ended ended = Run({"reconstruct", At("plain.xyz"), "-o", At("b.dss"), "--stations", "use"});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("--stations: to be used"));
}

}  // namespace
}  // namespace rilievo
