// Colours and intensity through the formats.
#include "client/formats/point_layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "client/formats/glb_writer.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/scan_reader.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using Color = std::array<uint8_t, 3>;

TriangleMesh Triangle() {
  TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Identity(3, 3);
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  return mesh;
}

const PointLayers kLayers = {{0.5f, 1000.0f, -2.0f}, {{1, 2, 3}, {255, 0, 9}, {4, 5, 6}}};

TEST(PointLayersTest, PlyBringsBackWhatWasWritten) {
  std::stringstream ply;
  const std::vector<HeightSource> sources(3, HeightSource::kFilled);
  ASSERT_TRUE(WritePlyMesh(Triangle(), sources, ply, kLayers).ok());
  const auto scan = ReadPlyScan(ply, {.intensity = true, .colors = true});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->layers.intensity, kLayers.intensity);
  EXPECT_EQ(scan->cloud.sights.colors, kLayers.colors);
  EXPECT_TRUE(scan->cloud.points == Triangle().vertices);
}

TEST(PointLayersTest, PlyColorsOfEveryType) {
  const auto read = [](const std::string& type, const std::string& row) {
    std::istringstream in("ply\nformat ascii 1.0\nelement vertex 1\nproperty " + type +
                          " blue\nproperty float x\nproperty float y\nproperty " + type +
                          " red\nproperty float z\nproperty " + type +
                          " green\nproperty double scalar_Intensity\nend_header\n" + row);
    return *ReadPlyScan(in, {.intensity = true, .colors = true});
  };
  EXPECT_THAT(read("uchar", "3 7 8 1 9 2 0.25\n").cloud.sights.colors, ElementsAre(Color{1, 2, 3}));
  EXPECT_THAT(read("ushort", "768 7 8 300 9 65535 0.25\n").cloud.sights.colors,
              ElementsAre(Color{1, 255, 3}));
  // Wide integers: as many bits as the largest value of the file needs, 8, 16 or 32.
  EXPECT_THAT(read("ushort", "3 7 8 1 9 200 0.25\n").cloud.sights.colors,
              ElementsAre(Color{1, 200, 3}));
  EXPECT_THAT(read("int", "3 7 8 255 9 -2 0.25\n").cloud.sights.colors,
              ElementsAre(Color{255, 0, 3}));
  EXPECT_THAT(read("uint", "768 7 8 300 9 65535 0.25\n").cloud.sights.colors,
              ElementsAre(Color{1, 255, 3}));
  EXPECT_THAT(read("uint", "4294967295 7 8 2147483648 9 16777216 0.25\n").cloud.sights.colors,
              ElementsAre(Color{128, 1, 255}));
  EXPECT_THAT(read("float", "255 7 8 12 9 127.6 0.25\n").cloud.sights.colors,
              ElementsAre(Color{12, 128, 255}));
  EXPECT_THAT(read("float", "nan 7 8 0.2 9 1 0.25\n").cloud.sights.colors,
              ElementsAre(Color{51, 255, 0}));
  const ScanFile real = read("float", "1 7 8 0.5 9 -4 0.25\n");
  EXPECT_THAT(real.cloud.sights.colors, ElementsAre(Color{128, 0, 255}));
  EXPECT_THAT(real.layers.intensity, ElementsAre(0.25f));
  EXPECT_TRUE(real.cloud.points.col(0) == Eigen::Vector3d(7, 8, 9));
}

TEST(PointLayersTest, WhatIsNotWantedOrNotThereIsEmpty) {
  std::stringstream ply;
  ASSERT_TRUE(WritePlyMesh(Triangle(), {}, ply, kLayers).ok());
  EXPECT_TRUE(ReadPlyScan(ply)->cloud.sights.colors.empty());
  std::stringstream plain;
  ASSERT_TRUE(WritePlyMesh(Triangle(), {}, plain).ok());
  const auto scan = ReadPlyScan(plain, {.intensity = true, .colors = true});
  EXPECT_TRUE(scan->cloud.sights.colors.empty());
  EXPECT_TRUE(scan->layers.intensity.empty());
}

TEST(PointLayersTest, GlbHoldsThem) {
  std::ostringstream out;
  ASSERT_TRUE(WriteGlbMesh(Triangle(), {}, out, kLayers).ok());
  const std::string bytes = out.str();
  const auto json = nlohmann::json::parse(bytes.substr(20, bytes.find("BIN") - 4 - 20));
  const auto& attributes = json["meshes"][0]["primitives"][0]["attributes"];
  const auto& color = json["accessors"][attributes["COLOR_0"].get<int>()];
  EXPECT_EQ(color["type"], "VEC4");
  EXPECT_EQ(color["normalized"], true);
  const auto& view = json["bufferViews"][color["bufferView"].get<int>()];
  const size_t at = bytes.find("BIN") + 4 + view["byteOffset"].get<size_t>();
  std::array<uint16_t, 12> linear;
  std::memcpy(linear.data(), bytes.data() + at, sizeof(linear));
  // sRGB 1, 2, 3; 255, 0, 9; 4, 5, 6, of 255: the straight part of the curve, 65535 / 255 / 12.92.
  EXPECT_THAT(linear, ElementsAre(20, 40, 60, 65535, 65535, 0, 179, 65535, 80, 99, 119, 65535));
  EXPECT_EQ(json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"],
            nlohmann::json({1, 1, 1, 1}));
  EXPECT_TRUE(attributes.contains("_INTENSITY"));
}

TEST(PointLayersTest, LayersOfAnotherSizeAreRefused) {
  const PointLayers two = {{1.0f, 2.0f}, {}};
  std::ostringstream out;
  EXPECT_FALSE(WritePlyMesh(Triangle(), {}, out, two).ok());
  EXPECT_FALSE(WriteGlbMesh(Triangle(), {}, out, two).ok());
  EXPECT_TRUE(out.str().empty());
}

}  // namespace
}  // namespace rilievo
