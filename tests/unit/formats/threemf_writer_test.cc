// 3MF files, unpacked again.
#include "client/formats/threemf/threemf_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <map>
#include <regex>
#include <sstream>
#include <string>

#include "tests/unit/formats/glb_parts.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using testing::LoadAt;
using ::testing::Not;

constexpr char kModelPart[] = "3D/3dmodel.model";

// The files of an archive, by the directory at its end; their checksums are compared.
std::map<std::string, std::string> Unzipped(const std::string& bytes) {
  std::map<std::string, std::string> files;
  const size_t end = bytes.size() - 22;
  EXPECT_EQ(bytes.substr(end, 4), "PK\5\6");
  const auto count = LoadAt<uint16_t>(bytes, end + 10);
  size_t at = LoadAt<uint32_t>(bytes, end + 16);
  EXPECT_EQ(at + LoadAt<uint32_t>(bytes, end + 12), end);
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(bytes.substr(at, 4), "PK\1\2");
    const auto checksum = LoadAt<uint32_t>(bytes, at + 16),
               packed = LoadAt<uint32_t>(bytes, at + 20),
               unpacked = LoadAt<uint32_t>(bytes, at + 24),
               local = LoadAt<uint32_t>(bytes, at + 42);
    const std::string name = bytes.substr(at + 46, LoadAt<uint16_t>(bytes, at + 28));
    EXPECT_EQ(bytes.substr(local, 4), "PK\3\4");
    EXPECT_EQ(bytes.substr(local + 30, name.size()), name);
    const size_t data = local + 30 + name.size();
    // Behind the bytes stand checksum and sizes once more.
    EXPECT_EQ(bytes.substr(data + packed, 4), "PK\7\10");
    EXPECT_EQ(LoadAt<uint32_t>(bytes, data + packed + 4), checksum);
    EXPECT_EQ(LoadAt<uint32_t>(bytes, data + packed + 12), unpacked);
    std::string text(unpacked, '\0');
    z_stream stream = {};
    inflateInit2(&stream, -15);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data())) + data;
    stream.avail_in = packed;
    stream.next_out = reinterpret_cast<Bytef*>(text.data());
    stream.avail_out = unpacked;
    EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
    EXPECT_EQ(stream.avail_in, 0u);
    inflateEnd(&stream);
    EXPECT_EQ(crc32(0, reinterpret_cast<const Bytef*>(text.data()), unpacked), checksum);
    files[name] = text;
    at += 46 + name.size();
  }
  return files;
}

TriangleMesh FlatTetrahedron() {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 0, 0,  //
      0, 0, 1, 0,               //
      0, 0, 0, 0.1;
  mesh.triangles.resize(3, 4);
  mesh.triangles << 0, 0, 0, 1,  //
      2, 1, 3, 2,                //
      1, 3, 2, 3;
  return mesh;
}

std::string ModelText(const TriangleMesh& mesh, const PointLayers& layers, const ScanPlace& place) {
  std::ostringstream out;
  EXPECT_TRUE(Write3mfMesh(mesh, out, layers, place).ok());
  return Unzipped(out.str())[kModelPart];
}

TEST(ThreemfWriterTest, IsAPackageOfThreeParts) {
  std::ostringstream out;
  ASSERT_TRUE(Write3mfMesh(FlatTetrahedron(), out).ok());
  std::map<std::string, std::string> files = Unzipped(out.str());
  ASSERT_EQ(files.size(), 3u);
  EXPECT_THAT(files["[Content_Types].xml"], HasSubstr("\"model\""));
  EXPECT_THAT(files["_rels/.rels"], HasSubstr("Target=\"/3D/3dmodel.model\""));
  const std::string& model = files[kModelPart];
  EXPECT_THAT(model, HasSubstr("unit=\"millimeter\""));
  EXPECT_THAT(model, HasSubstr("<vertex x=\"0\" y=\"0\" z=\"0.1\"/>"));
  EXPECT_THAT(model, HasSubstr("<triangle v1=\"1\" v2=\"2\" v3=\"3\"/>"));
  EXPECT_THAT(model, HasSubstr("type=\"model\""));
  EXPECT_THAT(model, Not(HasSubstr("transform")));
}

TEST(ThreemfWriterTest, NamesTheUnitAndScalesThoseItHasNoNameFor) {
  const std::pair<double, const char*> units[] = {{1, "meter"},         {0.001, "millimeter"},
                                                  {0.0254, "inch"},     {0.3048, "foot"},
                                                  {0.01, "centimeter"}, {1e-6, "micron"}};
  for (const auto& [metres, name] : units) {
    const std::string model = ModelText(FlatTetrahedron(), {}, {metres, UpDirection::kZ, ""});
    EXPECT_THAT(model, HasSubstr(std::string("unit=\"") + name + "\""));
    EXPECT_THAT(model, HasSubstr("z=\"0.1\""));
  }
  const std::string yards = ModelText(FlatTetrahedron(), {}, {0.9144, UpDirection::kZ, ""});
  EXPECT_THAT(yards, HasSubstr("unit=\"millimeter\""));
  EXPECT_THAT(yards, HasSubstr("z=\"91.44\""));
}

TEST(ThreemfWriterTest, TurnsTheWayUpToZ) {
  for (const auto& [up, direction] : {std::pair(UpDirection::kY, Eigen::Vector3d(0, 1, 0)),
                                      std::pair(UpDirection::kX, Eigen::Vector3d(1, 0, 0)),
                                      std::pair(UpDirection::kMinusZ, Eigen::Vector3d(0, 0, -1))}) {
    const std::string model = ModelText(FlatTetrahedron(), {}, {0, up, ""});
    std::smatch found;
    ASSERT_TRUE(std::regex_search(model, found, std::regex("transform=\"([^\"]*)\"")));
    std::istringstream numbers(found[1]);
    Eigen::Matrix<double, 4, 3, Eigen::RowMajor> rows;  // a point is a row, and stands before it
    for (double& entry : rows.reshaped<Eigen::RowMajor>()) numbers >> entry;
    const Eigen::RowVector3d turned = direction.transpose() * rows.topRows<3>();
    EXPECT_EQ(turned, Eigen::RowVector3d(0, 0, 1));
    EXPECT_DOUBLE_EQ(rows.topRows<3>().determinant(), 1);
  }
}

TEST(ThreemfWriterTest, OpenMeshesAreSurfacesAndColoursGoWithTheirVertices) {
  TriangleMesh open = FlatTetrahedron();
  open.triangles.conservativeResize(3, 3);
  PointLayers layers;
  layers.colors = {{1, 2, 3}, {255, 0, 16}, {0, 0, 0}, {9, 9, 9}};
  const std::string model = ModelText(open, layers, {});
  EXPECT_THAT(model, HasSubstr("type=\"surface\""));
  EXPECT_THAT(model, HasSubstr("<m:color color=\"#FF0010\"/>"));
  EXPECT_THAT(model, HasSubstr("v3=\"1\" pid=\"2\" p1=\"0\" p2=\"2\" p3=\"1\"/>"));
}

TEST(ThreemfWriterTest, RefusesWhatIsNotAMesh) {
  std::ostringstream out;
  TriangleMesh mesh = FlatTetrahedron();
  PointLayers one;
  one.colors = {{1, 2, 3}};
  EXPECT_TRUE(absl::IsInvalidArgument(Write3mfMesh(mesh, out, one)));
  mesh.triangles.resize(3, 0);
  EXPECT_TRUE(absl::IsInvalidArgument(Write3mfMesh(mesh, out)));
  EXPECT_TRUE(out.str().empty());
}

}  // namespace
}  // namespace rilievo
