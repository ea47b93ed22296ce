// GLB, taken apart again.
#include "client/formats/glb_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>

#include "tests/unit/formats/glb_parts.h"
#include "tests/unit/formats/surface_samples.h"

namespace rilievo {
namespace {

struct Glb {
  nlohmann::json json;
  std::string binary;

  // Value `k` of element `i` of an accessor.
  template <typename T>
  T Value(int accessor, size_t i, size_t k = 0) const {
    const auto& a = json["accessors"][accessor];
    const auto& view = json["bufferViews"][a["bufferView"].get<int>()];
    const size_t size = a["type"] == "VEC3" ? 3 * sizeof(T) : sizeof(T);
    return testing::LoadAt<T>(binary, view["byteOffset"].get<size_t>() +
                                          i * view.value("byteStride", size) + k * sizeof(T));
  }
};

Glb TakeApart(const std::string& bytes) {
  testing::GlbParts parts = testing::TakeGlbApart(bytes);
  return {std::move(parts.json), std::move(parts.binary)};
}

TEST(GlbWriterTest, HoldsTheMeshAndKeepsMapGrids) {
  const DisplacedSurface surface = testing::CreasedOctahedron(2);
  const TriangleMesh mesh = *Tessellate(surface, 2, RunContext());
  const std::vector<HeightSource> sources = SourcesAtLevel(surface, 2);
  std::ostringstream out;
  ASSERT_TRUE(WriteGlbMesh(mesh, sources, out).ok());
  const Glb glb = TakeApart(out.str());
  const auto& primitive = glb.json["meshes"][0]["primitives"][0];
  const auto& attributes = primitive["attributes"];
  const auto& moved = glb.json["nodes"][1]["translation"];
  const int position = attributes["POSITION"], normal = attributes["NORMAL"];
  ASSERT_EQ(glb.json["accessors"][position]["count"], mesh.vertices.cols());
  EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
  Eigen::Vector3f low = Eigen::Vector3f::Constant(1e9f), high = -low;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<size_t>(axis);
      const auto local = glb.Value<float>(position, static_cast<size_t>(v), k);
      low(axis) = std::min(low(axis), local);
      high(axis) = std::max(high(axis), local);
      // 4.6e6 in float would be off by a quarter.
      EXPECT_NEAR(local + moved[k].get<double>(), mesh.vertices(axis, v), 1e-6);
      EXPECT_EQ(glb.Value<float>(normal, static_cast<size_t>(v), k),
                static_cast<float>(mesh.normals(axis, v)));
    }
    EXPECT_EQ(glb.Value<uint8_t>(attributes["_SOURCE"], static_cast<size_t>(v)),
              static_cast<uint8_t>(sources[static_cast<size_t>(v)]));
  }
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto& accessor = glb.json["accessors"][position];
    EXPECT_EQ(accessor["min"][axis].get<float>(), low(static_cast<int>(axis)));
    EXPECT_EQ(accessor["max"][axis].get<float>(), high(static_cast<int>(axis)));
  }
  ASSERT_EQ(glb.json["accessors"][primitive["indices"].get<int>()]["count"], mesh.triangles.size());
  for (Eigen::Index i = 0; i < mesh.triangles.size(); ++i) {
    EXPECT_EQ(glb.Value<uint32_t>(primitive["indices"], static_cast<size_t>(i)),
              static_cast<uint32_t>(mesh.triangles.data()[i]));
  }
}

// A point of the file's mesh node in the scene, as glTF 2.0 section 3.5.3 multiplies.
Eigen::Vector3d InScene(const nlohmann::json& document, const Eigen::Vector3d& local) {
  const auto& root = document["nodes"][0];
  EXPECT_EQ(document["scenes"][0]["nodes"], nlohmann::json({0}));
  EXPECT_EQ(root["children"], nlohmann::json({1}));
  const auto vector = [](const nlohmann::json& row) {
    return Eigen::Vector3d(row[0].get<double>(), row[1].get<double>(), row[2].get<double>());
  };
  const auto& q = root["rotation"];
  const Eigen::Quaterniond turn(q[3].get<double>(), q[0].get<double>(), q[1].get<double>(),
                                q[2].get<double>());
  EXPECT_NEAR(turn.norm(), 1, 1e-15);
  const Eigen::Vector3d moved = local + vector(document["nodes"][1]["translation"]);
  return turn * vector(root["scale"]).cwiseProduct(moved);
}

TEST(GlbWriterTest, StandsUprightInMetres) {
  TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Identity(3, 3);
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  const std::pair<UpDirection, Eigen::Vector3d> ways[] = {
      {UpDirection::kUnknown, {0, 0, 1}}, {UpDirection::kX, {1, 0, 0}},
      {UpDirection::kY, {0, 1, 0}},       {UpDirection::kZ, {0, 0, 1}},
      {UpDirection::kMinusX, {-1, 0, 0}}, {UpDirection::kMinusY, {0, -1, 0}},
      {UpDirection::kMinusZ, {0, 0, -1}}};
  for (const auto& [up, direction] : ways) {
    std::ostringstream out;
    ASSERT_TRUE(WriteGlbMesh(mesh, {}, out, {}, {0.001, up, ""}).ok());
    const Glb glb = TakeApart(out.str());
    const Eigen::Vector3d middle = Eigen::Vector3d::Constant(0.5);
    const Eigen::Vector3d there = InScene(glb.json, direction - middle);
    EXPECT_LT((there - Eigen::Vector3d(0, 0.001, 0)).norm(), 1e-18) << static_cast<int>(up);
  }
  std::ostringstream out;
  ASSERT_TRUE(WriteGlbMesh(mesh, {}, out).ok());
  EXPECT_EQ(TakeApart(out.str()).json["nodes"][0]["scale"], nlohmann::json({1, 1, 1}));
}

TEST(GlbWriterTest, WithoutNormalsAndSources) {
  TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Identity(3, 3);
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  std::ostringstream out;
  ASSERT_TRUE(WriteGlbMesh(mesh, {}, out).ok());
  const Glb glb = TakeApart(out.str());
  EXPECT_EQ(glb.json["meshes"][0]["primitives"][0]["attributes"].size(), 1u);
  EXPECT_EQ(glb.binary.size(), 3u * 12 + 12);
}

TEST(GlbWriterTest, RefusesWhatTheFormatCannotHold) {
  std::ostringstream out;
  EXPECT_FALSE(WriteGlbMesh({}, {}, out).ok());
  TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Identity(3, 3);
  EXPECT_FALSE(WriteGlbMesh(mesh, {}, out).ok());
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  const std::vector<HeightSource> two(2, HeightSource::kFilled);
  EXPECT_FALSE(WriteGlbMesh(mesh, two, out).ok());
  EXPECT_TRUE(out.str().empty());
}

}  // namespace
}  // namespace rilievo
