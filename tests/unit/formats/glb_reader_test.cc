// GLB files made by hand, and the own writer's, read as meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "client/formats/export_axes.h"
#include "client/formats/glb_writer.h"
#include "client/formats/mesh_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using nlohmann::json;
using rilievo::testing::Raw;
using ::testing::HasSubstr;

std::string Chunk(const std::string& type, std::string bytes, char filling) {
  while (bytes.size() % 4 != 0) bytes += filling;
  return Raw(static_cast<uint32_t>(bytes.size())) + type + bytes;
}

std::string GlbBytes(const std::string& text, const std::string& binary) {
  const std::string chunks =
      Chunk("JSON", text, ' ') + Chunk(std::string("BIN\0", 4), binary, '\0');
  return "glTF" + Raw(uint32_t{2}) + Raw(static_cast<uint32_t>(12 + chunks.size())) + chunks;
}

// A square of four vertices, counter-clockwise seen from +z, as two triangles.
struct SquareGlb {
  json root;
  std::string binary;

  SquareGlb() {
    for (const auto& [x, y] : {std::pair{0.f, 0.f}, {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}}) {
      binary += Raw(x) + Raw(y) + Raw(0.f);
    }
    for (const uint16_t index : {0, 1, 2, 0, 2, 3}) binary += Raw(index);
    root = json::parse(R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
          {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
          {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48},
                        {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"byteLength": 60}]})");
  }

  // A list of numbers as a further accessor; gives its number.
  template <typename T>
  size_t Add(const std::vector<T>& values, int component, const char* type, size_t width) {
    std::string bytes;
    for (const T value : values) bytes += Raw(value);
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
    root["accessors"].push_back({{"bufferView", root["bufferViews"].size() - 1},
                                 {"componentType", component},
                                 {"count", values.size() / width},
                                 {"type", type}});
    binary += bytes;
    return root["accessors"].size() - 1;
  }

  json& primitive() { return root["meshes"][0]["primitives"][0]; }
  std::string bytes() const { return GlbBytes(root.dump(), binary); }
};

absl::StatusOr<MeshFile> Read(const std::string& bytes) {
  std::istringstream in(bytes);
  return ReadGlbMesh(in);
}
absl::StatusOr<MeshFile> Read(const SquareGlb& glb) { return Read(glb.bytes()); }

std::string ErrorOf(const SquareGlb& glb) {
  const auto read = Read(glb);
  EXPECT_FALSE(read.ok()) << glb.root;
  return std::string(read.status().message());
}

// Half the sum of the triangles' cross products.
Eigen::Vector3d AreaVector(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, f));
    const Eigen::Vector3d b = mesh.vertices.col(mesh.triangles(1, f));
    const Eigen::Vector3d c = mesh.vertices.col(mesh.triangles(2, f));
    sum += (b - a).cross(c - a) / 2;
  }
  return sum;
}

void ExpectArea(const absl::StatusOr<MeshFile>& read, const Eigen::Vector3d& expected) {
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_LT((AreaVector(read->mesh) - expected).norm(), 1e-12) << AreaVector(read->mesh);
}

TEST(GlbReaderTest, ASquareIsReadAsItStands) {
  std::istringstream in(SquareGlb().bytes());
  const auto read = ReadMeshStream(in, "-");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->format, "GLB");
  EXPECT_EQ(read->mesh.vertices,
            (Eigen::Matrix3Xd(3, 4) << 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0).finished());
  EXPECT_EQ(read->mesh.triangles, (Eigen::Matrix3Xi(3, 2) << 0, 0, 1, 2, 2, 3).finished());
  EXPECT_EQ(read->place, (ScanPlace{1, UpDirection::kY, ""}));
  EXPECT_TRUE(read->colors.empty());
}

TEST(GlbReaderTest, TheOwnExportComesBackUprightInMetresWithItsColors) {
  // One vertex for each value of a channel, about a place of a map.
  const Eigen::Vector3d origin(4.6e6, 5.5e6, 300);
  TriangleMesh mesh;
  mesh.vertices.resize(3, 256);
  PointLayers layers;
  for (int v = 0; v < 256; ++v) {
    mesh.vertices.col(v) = origin + Eigen::Vector3d(v / 16, v % 16, 0.001 * v);
    const auto value = static_cast<uint8_t>(v);
    layers.colors.push_back({value, static_cast<uint8_t>(255 - v), 7});
  }
  mesh.triangles.resize(3, 15 * 15);
  for (int f = 0; f < 15 * 15; ++f) {
    const int first = f / 15 * 16 + f % 15;
    mesh.triangles.col(f) = Eigen::Vector3i(first, first + 16, first + 1);
  }
  const ScanPlace place{0.001, UpDirection::kZ, ""};
  std::ostringstream out;
  ASSERT_TRUE(WriteGlbMesh(mesh, {}, out, layers, place).ok());
  const auto read = Read(out.str());
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->mesh.triangles.cols(), mesh.triangles.cols());
  ASSERT_EQ(read->colors.size(), static_cast<size_t>(read->mesh.vertices.cols()));
  for (Eigen::Index i = 0; i < mesh.triangles.size(); ++i) {
    const int then = mesh.triangles.data()[i], now = read->mesh.triangles.data()[i];
    const Eigen::Vector3d expected = 0.001 * (YUpFrom(place.up) * mesh.vertices.col(then));
    ASSERT_LT((read->mesh.vertices.col(now) - expected).norm(), 1e-8);
    ASSERT_EQ(read->colors[static_cast<size_t>(now)], layers.colors[static_cast<size_t>(then)]);
  }
}

TEST(GlbReaderTest, NodesMoveTheirMeshes) {
  SquareGlb glb;
  const double half = std::numbers::sqrt2 / 2;
  // A quarter turn about x takes z to -y; then twice as large.
  glb.root["nodes"] = {
      {{"children", {1}}, {"scale", {2, 2, 2}}, {"translation", {10, 0, 0}}},
      {{"children", {2}}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1}}},
      {{"mesh", 0}, {"rotation", {half, 0, 0, half}}}};
  const auto read = Read(glb);
  ExpectArea(read, {0, -4, 0});
  EXPECT_LT((read->mesh.vertices.rowwise().minCoeff() - Eigen::Vector3d(10, 10, 0)).norm(), 1e-12);
  EXPECT_LT((read->mesh.vertices.rowwise().maxCoeff() - Eigen::Vector3d(12, 10, 2)).norm(), 1e-12);
}

TEST(GlbReaderTest, AMirroringNodeTurnsTrianglesOver) {
  SquareGlb glb;
  glb.root["nodes"][0]["scale"] = {-1, 1, 1};
  ExpectArea(Read(glb), {0, 0, 1});
  glb.root["nodes"][0]["scale"] = {1, 1, -1};
  ExpectArea(Read(glb), {0, 0, -1});
  glb.root["nodes"][0]["scale"] = {-1, -1, 1};
  ExpectArea(Read(glb), {0, 0, 1});
}

TEST(GlbReaderTest, OnlyTheDefaultSceneIsRead) {
  SquareGlb glb;
  glb.root["nodes"].push_back({{"mesh", 0}, {"translation", {5, 0, 0}}});
  ExpectArea(Read(glb), {0, 0, 1});
  glb.root.erase("scene");  // then all root nodes
  ExpectArea(Read(glb), {0, 0, 2});
}

TEST(GlbReaderTest, StripsFansAndBareVertices) {
  SquareGlb glb;
  glb.primitive()["mode"] = 6;  // the vertices in order are a fan
  glb.primitive().erase("indices");
  ExpectArea(Read(glb), {0, 0, 1});
  glb.primitive()["mode"] = 5;
  glb.primitive()["indices"] = glb.Add<uint8_t>({0, 1, 3, 2}, 5121, "SCALAR", 1);
  ExpectArea(Read(glb), {0, 0, 1});
  // A doubled corner joins two strips; the second begins with an even triangle.
  glb.primitive()["indices"] = glb.Add<uint32_t>({0, 1, 3, 3, 3, 1, 2}, 5125, "SCALAR", 1);
  const auto joined = Read(glb);
  ASSERT_TRUE(joined.ok()) << joined.status();
  EXPECT_EQ(joined->mesh.triangles.cols(), 2);
  glb.primitive()["mode"] = 4;
  glb.primitive()["attributes"]["POSITION"] =
      glb.Add<float>({0, 0, 0, 2, 0, 0, 0, 2, 0}, 5126, "VEC3", 3);
  glb.primitive().erase("indices");
  ExpectArea(Read(glb), {0, 0, 2});
}

TEST(GlbReaderTest, CornersAtOnePlaceAreOneVertexAndUnusedRowsNone) {
  SquareGlb glb;
  glb.primitive()["attributes"]["POSITION"] = glb.Add<float>(
      {9, 9, 9, 0, 0, 0, 1, 0, 0, 1, 1, 0, -0.f, 0, 0, 1, 1, 0, 0, 1, 0}, 5126, "VEC3", 3);
  glb.primitive()["indices"] = glb.Add<uint8_t>({1, 2, 3, 4, 5, 6}, 5121, "SCALAR", 1);
  const auto read = Read(glb);
  ExpectArea(read, {0, 0, 1});
  EXPECT_EQ(read->mesh.vertices.cols(), 4);
}

TEST(GlbReaderTest, RowsMayBeApart) {
  SquareGlb glb;
  std::vector<float> rows;
  for (const float x : {0.f, 3.f, 0.f}) rows.insert(rows.end(), {x, x > 0 ? 0.f : 1.f, 0, 7, 7});
  rows[1] = 0;
  rows.resize(rows.size() - 2);  // the last row need not be filled
  glb.primitive()["attributes"]["POSITION"] = glb.Add<float>(rows, 5126, "VEC3", 3);
  glb.root["bufferViews"].back()["byteStride"] = 20;
  glb.root["accessors"].back()["count"] = 3;
  glb.primitive().erase("indices");
  ExpectArea(Read(glb), {0, 0, 1.5});
}

TEST(GlbReaderTest, ColorsOfAllKindsBecomeSrgb) {
  const auto colors_of = [](SquareGlb glb, size_t accessor, bool normalized) {
    glb.root["accessors"][accessor]["normalized"] = normalized;
    glb.primitive()["attributes"]["COLOR_0"] = accessor;
    const auto read = Read(glb);
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? read->colors : std::vector<Rgb>();
  };
  // Linear 0.2159 is half of full sRGB.
  const std::vector<Rgb> expected(4, Rgb{128, 255, 0});
  SquareGlb glb;
  std::vector<float> reals;
  std::vector<uint8_t> bytes;
  std::vector<uint16_t> shorts;
  for (int v = 0; v < 4; ++v) {
    reals.insert(reals.end(), {0.2159f, 1.5f, -1.f});
    bytes.insert(bytes.end(), {55, 255, 0, 99});
    shorts.insert(shorts.end(), {14146, 65535, 0, 0});
  }
  EXPECT_EQ(colors_of(glb, glb.Add(reals, 5126, "VEC3", 3), false), expected);
  EXPECT_EQ(colors_of(glb, glb.Add(bytes, 5121, "VEC4", 4), true), expected);
  EXPECT_EQ(colors_of(glb, glb.Add(shorts, 5123, "VEC4", 4), true), expected);
  // One primitive without leaves none.
  glb.root["meshes"][0]["primitives"].push_back(glb.primitive());
  glb.primitive()["attributes"]["COLOR_0"] = 2;
  const auto mixed = Read(glb);
  ASSERT_TRUE(mixed.ok()) << mixed.status();
  EXPECT_TRUE(mixed->colors.empty());
}

TEST(GlbReaderTest, WhatIsNotTrianglesIsPassedOver) {
  SquareGlb glb;
  json points = glb.primitive();
  points["mode"] = 0;
  glb.root["meshes"][0]["primitives"].push_back(points);
  ExpectArea(Read(glb), {0, 0, 1});
  glb.primitive()["mode"] = 1;
  EXPECT_THAT(ErrorOf(glb), HasSubstr("no triangles"));
}

TEST(GlbReaderTest, RefusesByNameWhatItDoesNotRead) {
  for (const char* name :
       {"KHR_draco_mesh_compression", "KHR_meshopt_compression", "EXT_unheard_of"}) {
    SquareGlb glb;
    glb.root["extensionsRequired"] = {"KHR_materials_unlit"};
    EXPECT_TRUE(Read(glb).ok());
    glb.root["extensionsRequired"].push_back(name);
    EXPECT_THAT(ErrorOf(glb), HasSubstr(name));
    EXPECT_THAT(ErrorOf(glb), HasSubstr("export the mesh with"));
  }
  SquareGlb sparse, elsewhere, posed, old;
  sparse.root["accessors"][0]["sparse"] = {{"count", 1}};
  EXPECT_THAT(ErrorOf(sparse), HasSubstr("accessors[0]: sparse"));
  elsewhere.root["buffers"][0]["uri"] = "a.bin";
  EXPECT_THAT(ErrorOf(elsewhere), HasSubstr("buffers[0] is not within the file"));
  posed.root["nodes"][0]["skin"] = 0;
  EXPECT_THAT(ErrorOf(posed), HasSubstr("nodes[0]: has a skin"));
  std::string bytes = old.bytes();
  bytes[4] = 1;
  EXPECT_THAT(std::string(Read(bytes).status().message()), HasSubstr("version 1"));
}

TEST(GlbReaderTest, NodesMustBeATree) {
  SquareGlb twice, circle, missing, deep;
  twice.root["nodes"] = {{{"children", {1, 1}}}, {{"mesh", 0}}};
  EXPECT_THAT(ErrorOf(twice), HasSubstr("nodes[1]: is a child twice"));
  circle.root["nodes"] = {{{"children", {1}}, {"mesh", 0}}, {{"children", {0}}}};
  EXPECT_THAT(ErrorOf(circle), HasSubstr("nodes[0]: is in the scene twice"));
  circle.root.erase("scene");
  EXPECT_THAT(ErrorOf(circle), HasSubstr("no triangles"));
  missing.root["nodes"][0]["children"] = {1};
  EXPECT_THAT(ErrorOf(missing), HasSubstr("child 1 does not exist"));
  for (int node = 0; node < 300; ++node) {
    deep.root["nodes"][node] = {{"children", {node + 1}}};
  }
  deep.root["nodes"][300] = {{"mesh", 0}};
  EXPECT_THAT(ErrorOf(deep), HasSubstr("nodes[256]: is more than 256 deep"));
}

TEST(GlbReaderTest, NothingIsBelievedThatTheBytesDoNotHold) {
  const auto error_with = [](const char* pointer, const json& value) {
    SquareGlb glb;
    glb.root[json::json_pointer(pointer)] = value;
    return ErrorOf(glb);
  };
  constexpr uint64_t kHuge = UINT64_MAX;
  EXPECT_THAT(error_with("/accessors/0/count", kHuge),
              HasSubstr("accessors[0]: 'count' is 184467"));
  EXPECT_THAT(error_with("/accessors/0/count", 5), HasSubstr("'count' is 5"));
  EXPECT_THAT(error_with("/accessors/0/count", 0), HasSubstr("'count' is 0"));
  EXPECT_THAT(error_with("/accessors/0/count", -4), HasSubstr("'count' must be a whole number"));
  EXPECT_THAT(error_with("/accessors/0/count", "4"), HasSubstr("'count' must be a whole number"));
  EXPECT_THAT(error_with("/accessors/0/byteOffset", kHuge), HasSubstr("from byte 184467"));
  EXPECT_THAT(error_with("/accessors/0/byteOffset", 1), HasSubstr("from byte 1"));
  EXPECT_THAT(error_with("/accessors/0/bufferView", 2), HasSubstr("there is no bufferViews[2]"));
  EXPECT_THAT(error_with("/accessors/0/type", "MAT4"), HasSubstr("'type'"));
  EXPECT_THAT(error_with("/accessors/0/componentType", 5124), HasSubstr("'componentType' is 5124"));
  EXPECT_THAT(error_with("/accessors/0/componentType", 5125), HasSubstr("POSITION must be"));
  EXPECT_THAT(error_with("/bufferViews/0/byteLength", kHuge), HasSubstr("184467"));
  EXPECT_THAT(error_with("/bufferViews/0/byteOffset", kHuge), HasSubstr("184467"));
  EXPECT_THAT(error_with("/bufferViews/0/byteOffset", 16), HasSubstr("48 bytes from 16"));
  EXPECT_THAT(error_with("/bufferViews/0/byteStride", 4), HasSubstr("'byteStride' is 4"));
  EXPECT_THAT(error_with("/bufferViews/0/byteStride", kHuge), HasSubstr("'count' is 4"));
  EXPECT_THAT(error_with("/bufferViews/0/buffer", 1), HasSubstr("there is no buffers[1]"));
  EXPECT_THAT(error_with("/accessors/1/type", "VEC2"), HasSubstr("'count' is 6"));
  EXPECT_THAT(error_with("/meshes/0/primitives/0/indices", 0), HasSubstr("'indices' must be"));
  EXPECT_THAT(error_with("/accessors/1/count", 4), HasSubstr("4 corners"));
  EXPECT_THAT(error_with("/accessors/1/count", 7), HasSubstr("'count' is 7"));
  EXPECT_THAT(error_with("/accessors/0/count", 3), HasSubstr("index 5 names vertex 3 of 3"));
  EXPECT_THAT(error_with("/nodes/0/mesh", 1), HasSubstr("there is no meshes[1]"));
  EXPECT_THAT(error_with("/nodes/0/matrix", {1, 2}), HasSubstr("'matrix' must be 16 numbers"));
  EXPECT_THAT(error_with("/nodes/0/rotation", {0, 0, 0, 0}), HasSubstr("unit quaternion"));
  EXPECT_THAT(error_with("/nodes", 3), HasSubstr("'nodes' must be a list"));
  EXPECT_THAT(error_with("/nodes/0", 3), HasSubstr("nodes[0] must be an object"));
  EXPECT_THAT(error_with("/scenes/0/nodes/0", 7), HasSubstr("there is no nodes[7]"));
  EXPECT_THAT(error_with("/scene", 1), HasSubstr("there is no scenes[1]"));
}

TEST(GlbReaderTest, EveryPrefixEndsInAnError) {
  const std::string bytes = SquareGlb().bytes();
  ASSERT_TRUE(Read(bytes).ok());
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(Read(bytes.substr(0, length)).ok()) << length;
  }
}

TEST(GlbReaderTest, EveryChangedByteEndsInAMeshOrAnError) {
  const std::string bytes = SquareGlb().bytes();
  for (size_t at = 0; at < bytes.size(); ++at) {
    for (const char value : {'\0', '9', '[', '-', '\xff'}) {
      std::string changed = bytes;
      changed[at] = value;
      const auto read = Read(changed);
      if (!read.ok()) continue;
      ASSERT_GE(read->mesh.triangles.minCoeff(), 0);
      ASSERT_LT(read->mesh.triangles.maxCoeff(), read->mesh.vertices.cols());
    }
  }
}

TEST(GlbReaderTest, ASmallFileStaysASmallMesh) {
  SquareGlb glb;
  json& primitives = glb.root["meshes"][0]["primitives"];
  for (int i = 0; i < 3000; ++i) primitives.push_back(primitives[0]);
  glb.root["nodes"] = json::array();
  glb.root["scenes"][0]["nodes"] = json::array();
  for (int node = 0; node < 3000; ++node) {
    glb.root["nodes"].push_back({{"mesh", 0}, {"translation", {node, 0, 0}}});
    glb.root["scenes"][0]["nodes"].push_back(node);
  }
  EXPECT_THAT(ErrorOf(glb), HasSubstr("so often"));
  for (json& primitive : primitives) primitive["mode"] = 0;
  EXPECT_THAT(ErrorOf(glb), HasSubstr("so often"));

  const auto error_of = [](const std::string& text) {
    return std::string(Read(GlbBytes(text, "")).status().message());
  };
  EXPECT_THAT(error_of(R"({"nodes": )" + std::string(2'000'000, '[')), HasSubstr("1000000 values"));
  EXPECT_THAT(error_of(std::string(1000, '[')), HasSubstr("not a JSON object"));
  EXPECT_THAT(error_of(std::string((16 << 20) + 4, ' ')), HasSubstr("more than 16 MiB"));
  // What is not of the mesh may be long.
  SquareGlb talking;
  talking.root["extras"] = json(std::vector<int>(300'000, 1));
  talking.root["nodes"][0]["extras"] = talking.root["extras"];
  EXPECT_TRUE(Read(talking).ok());
}

}  // namespace
}  // namespace rilievo
