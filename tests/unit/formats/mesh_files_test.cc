// Mesh writers and readers against each other and against bytes written by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client/formats/atomic_file.h"
#include "client/formats/mesh_reader.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/scan_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;
using rilievo::testing::Raw;
using ::testing::HasSubstr;

TriangleMesh Octahedron() {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 6);
  mesh.vertices << 1, -1, 0, 0, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 0, 0, 1, -1;
  mesh.triangles.resize(3, 8);
  mesh.triangles << 0, 2, 1, 3, 2, 1, 3, 0, 2, 1, 3, 0, 0, 2, 1, 3, 4, 4, 4, 4, 5, 5, 5, 5;
  mesh.normals = mesh.vertices;
  return mesh;
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "rilievo-formats-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { fs::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  size_t files() const {
    return static_cast<size_t>(
        std::distance(fs::directory_iterator(path_), fs::directory_iterator()));
  }

 private:
  fs::path path_;
};

TEST(MeshFilesTest, StripsOfPlyAreFaces) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
      "property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n";
  // A strip of two, a triangle, and a strip that a corner told twice carries on.
  std::istringstream strips(header + "14 0 1 2 3 -1 2 3 4 -1 0 1 1 2 0\n");
  const auto file = ReadPlyMesh(strips);
  ASSERT_TRUE(file.ok()) << file.status();
  Eigen::Matrix3Xi expected(3, 4);
  expected << 0, 2, 2, 1,  //
      1, 1, 3, 2,          //
      2, 3, 4, 0;
  EXPECT_EQ(file->mesh.triangles, expected);
  std::istringstream wrong(header + "4 0 1 2 5\n");
  EXPECT_THAT(ReadPlyMesh(wrong).status().message(),
              ::testing::AllOf(HasSubstr("tristrips"), HasSubstr("names vertex 5")));
}

TEST(MeshFilesTest, PlyRoundTripKeepsAll) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = Octahedron();
  const std::vector<HeightSource> sources = {HeightSource::kMeasured, HeightSource::kSmoothed,
                                             HeightSource::kFilled,   HeightSource::kMeasured,
                                             HeightSource::kFilled,   HeightSource::kSmoothed};
  ASSERT_TRUE(WriteMesh(folder / "a.ply", mesh, sources).ok());
  const auto read = ReadMesh(folder / "a.ply");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(read->mesh.vertices == mesh.vertices);
  EXPECT_TRUE(read->mesh.triangles == mesh.triangles);
  EXPECT_TRUE(read->mesh.normals == mesh.normals);
  EXPECT_EQ(read->source, (std::vector<uint8_t>{0, 1, 2, 0, 2, 1}));
}

TEST(MeshFilesTest, PlyAndObjKeepColors) {
  PointLayers layers;
  for (uint8_t v = 0; v < 6; ++v) layers.colors.push_back({v, static_cast<uint8_t>(40 * v), 255});
  std::stringstream ply, obj;
  ASSERT_TRUE(WritePlyMesh(Octahedron(), std::vector<HeightSource>(6), ply, layers).ok());
  ASSERT_TRUE(WriteObjMesh(Octahedron(), obj, layers).ok());
  EXPECT_EQ(ReadPlyMesh(ply)->colors, layers.colors);
  EXPECT_EQ(ReadObjMesh(obj)->colors, layers.colors);
  std::istringstream one_without("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n");
  EXPECT_TRUE(ReadObjMesh(one_without)->colors.empty());
}

TEST(MeshFilesTest, PlyGoesToDoubleWhereFloatWouldLose) {
  TriangleMesh mesh = Octahedron();
  std::ostringstream near_origin, map_grid;
  ASSERT_TRUE(WritePlyMesh(mesh, {}, near_origin).ok());
  EXPECT_THAT(near_origin.str(), HasSubstr("property float x"));
  mesh.vertices.colwise() += Eigen::Vector3d(500000.125, 4600000.3, 200.7);
  ASSERT_TRUE(WritePlyMesh(mesh, {}, map_grid).ok());
  EXPECT_THAT(map_grid.str(), HasSubstr("property double x"));
  std::istringstream in(map_grid.str());
  EXPECT_TRUE(ReadPlyMesh(in)->mesh.vertices == mesh.vertices);
}

TEST(MeshFilesTest, PointsKeepEveryBit) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 100000);
  std::stringstream file;
  ASSERT_TRUE(WritePlyPoints(points, Eigen::Matrix3Xd(3, 0), file).ok());
  const auto scan = ReadPlyScan(file);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points == points);
}

TEST(MeshFilesTest, ObjKeepsEveryBitAndCorner) {
  const TemporaryFolder folder;
  TriangleMesh mesh = Octahedron();
  mesh.vertices += Eigen::Matrix3Xd::Constant(3, 6, 1e6 / 3);
  ASSERT_TRUE(WriteMesh(folder / "a.obj", mesh, {}).ok());
  const auto read = ReadMesh(folder / "a.obj");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(read->mesh.vertices == mesh.vertices);
  EXPECT_TRUE(read->mesh.triangles == mesh.triangles);
}

TEST(MeshFilesTest, StlWeldsCornersAndKeepsFaces) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = Octahedron();
  ASSERT_TRUE(WriteMesh(folder / "a.stl", mesh, {}).ok());
  EXPECT_EQ(fs::file_size(folder / "a.stl"), 84u + 50 * 8);
  const auto read = ReadMesh(folder / "a.stl");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->mesh.vertices.cols(), 6);
  for (int f = 0; f < 8; ++f) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_TRUE(read->mesh.vertices.col(read->mesh.triangles(k, f)) ==
                  mesh.vertices.col(mesh.triangles(k, f)));
    }
  }
}

TEST(MeshFilesTest, StlNormalsPointOutward) {
  std::ostringstream out;
  ASSERT_TRUE(WriteStlMesh(Octahedron(), out).ok());
  const std::string bytes = out.str();
  float normal[3];
  std::memcpy(normal, bytes.data() + 84, 12);
  for (float coordinate : normal) EXPECT_NEAR(coordinate, 1 / std::sqrt(3.0), 1e-7);
}

TEST(MeshFilesTest, AsciiStl) {
  std::istringstream in(
      "solid a\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n"
      " endloop\n endfacet\nendsolid a\n");
  const auto read = ReadStlMesh(in);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->mesh.triangles, (Eigen::Matrix3Xi(3, 1) << 0, 1, 2).finished());
  std::istringstream cut("solid a\n facet normal 0 0 1\n vertex 0 0 0\n");
  EXPECT_EQ(ReadStlMesh(cut).status().code(), absl::StatusCode::kDataLoss);
}

TEST(MeshFilesTest, PolygonsBecomeFans) {
  std::istringstream obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4/1 -3//2 3/3/3 4\n");
  const auto read = ReadObjMesh(obj);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->mesh.triangles, (Eigen::Matrix3Xi(3, 2) << 0, 0, 1, 2, 2, 3).finished());
}

TEST(MeshFilesTest, BadFacesAreNamed) {
  const auto obj_error = [](const std::string& text) {
    std::istringstream in(text);
    return std::string(ReadObjMesh(in).status().message());
  };
  EXPECT_THAT(obj_error("v 0 0 0\nf 1 2 3\n"), HasSubstr("names vertex 3 of 1"));
  EXPECT_THAT(obj_error("v 0 0 0\nf 0 1 1\n"), HasSubstr("line 2"));
  EXPECT_THAT(obj_error("v 0 0 0\nf 1 1\n"), HasSubstr("2 corners"));
  EXPECT_THAT(obj_error("v 0 0 0\nf 1 b 1\n"), HasSubstr("'b'"));

  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
      "property float y\nproperty float z\nelement face ";
  const std::string list = "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto ply_error = [&](const std::string& count, const std::string& faces) {
    std::istringstream in(head + count + list + std::string(12, '\0') + faces);
    return std::string(ReadPlyMesh(in).status().message());
  };
  EXPECT_THAT(ply_error("1", Raw(uint8_t{3}) + Raw(0) + Raw(0) + Raw(7)),
              HasSubstr("number 1: a face names vertex 7 of 1"));
  EXPECT_THAT(ply_error("1", Raw(uint8_t{3}) + Raw(0) + Raw(-1) + Raw(0)), HasSubstr("-1"));
  EXPECT_THAT(ply_error("4000000000", Raw(uint8_t{3})), HasSubstr("4000000000"));
  EXPECT_THAT(ply_error("1", Raw(uint8_t{200}) + Raw(0)), HasSubstr("200 items"));
}

TEST(MeshFilesTest, EveryPrefixEndsCleanly) {
  std::ostringstream ply, obj, stl;
  ASSERT_TRUE(WritePlyMesh(Octahedron(), {}, ply).ok());
  ASSERT_TRUE(WriteObjMesh(Octahedron(), obj).ok());
  ASSERT_TRUE(WriteStlMesh(Octahedron(), stl).ok());
  for (size_t length = 0; length < ply.str().size(); ++length) {
    std::istringstream in(ply.str().substr(0, length));
    EXPECT_FALSE(ReadPlyMesh(in).ok()) << length;
  }
  for (size_t length = 0; length < stl.str().size(); ++length) {
    std::istringstream in(stl.str().substr(0, length));
    EXPECT_FALSE(ReadStlMesh(in).ok()) << length;
  }
  for (size_t length = 0; length < obj.str().size(); ++length) {
    std::istringstream in(obj.str().substr(0, length));
    const auto read = ReadObjMesh(in);
    if (read.ok()) {
      EXPECT_LE(read->mesh.triangles.cols(), 8);
    }
  }
}

TEST(MeshFilesTest, WrongNumberOfSourcesIsRefused) {
  std::ostringstream out;
  const std::vector<HeightSource> two(2);
  EXPECT_EQ(WritePlyMesh(Octahedron(), two, out).code(), absl::StatusCode::kInvalidArgument);
}

TEST(AtomicFileTest, AFailureLeavesTheOldFileAndNoOther) {
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "a", [](std::ostream& out) {
                out << "old";
                return absl::OkStatus();
              }).ok());
  const absl::Status failed = WriteFileAtomically(folder / "a", [](std::ostream& out) {
    out << "new but broken";
    return absl::InternalError("on purpose");
  });
  EXPECT_EQ(failed.message(), "on purpose");
  std::string content;
  std::ifstream(folder / "a") >> content;
  EXPECT_EQ(content, "old");
  EXPECT_EQ(folder.files(), 1u);
}

TEST(AtomicFileTest, AnswersForPlacesThatCannotBeWritten) {
  const TemporaryFolder folder;
  const auto nothing = [](std::ostream&) { return absl::OkStatus(); };
  const absl::Status missing = WriteFileAtomically(folder / "no/such/a", nothing);
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(missing.message()), HasSubstr("no/such/a"));
  EXPECT_FALSE(CheckWritable(folder / "no/such/a").ok());
  EXPECT_FALSE(CheckWritable(folder / "").ok());
  EXPECT_TRUE(CheckWritable(folder / "a").ok());
  EXPECT_TRUE(CheckWritable("/dev/null").ok());
  EXPECT_TRUE(WriteFileAtomically("/dev/null", nothing).ok());
  EXPECT_FALSE(WriteFileAtomically(folder / "", nothing).ok());
  const absl::Status full = WriteFileAtomically("/dev/full", [](std::ostream& out) {
    out << std::string(100000, 'x');
    return absl::OkStatus();
  });
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted) << full;
}

TEST(AtomicFileTest, NewFilesHaveTheUsualPermissions) {
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteBytesAtomically(folder / "a", {}).ok());
  std::ofstream(folder / "b") << "";
  EXPECT_EQ(fs::status(folder / "a").permissions(), fs::status(folder / "b").permissions());
}

}  // namespace
}  // namespace rilievo
