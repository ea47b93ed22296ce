// Compressed GLB files, unpacked with the decoders of libmeshoptimizer.
#include "client/formats/meshopt/compress_glb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "client/formats/mesh_reader.h"
#include "client/formats/meshopt/unpack_rows.h"
#include "core/surface/displaced_surface.h"
#include "tests/unit/formats/glb_parts.h"
#include "tests/unit/formats/surface_samples.h"

namespace rilievo {
namespace {

using testing::LoadAt;
using Json = nlohmann::json;

// The rows of an accessor, unpacked.
std::string UnpackedRows(const testing::GlbParts& glb, int accessor) {
  const Json& view =
      glb.json["bufferViews"][glb.json["accessors"][accessor]["bufferView"].get<int>()];
  const Json& packed = view["extensions"]["EXT_meshopt_compression"];
  EXPECT_EQ(packed["buffer"], 0);
  EXPECT_EQ(view["buffer"], 1);
  const size_t count = packed["count"], stride = packed["byteStride"];
  EXPECT_EQ(view["byteLength"], count * stride);
  const std::string bytes =
      glb.binary.substr(packed["byteOffset"].get<size_t>(), packed["byteLength"].get<size_t>());
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  std::string rows(count * stride, '\0');
  if (packed["mode"] == "TRIANGLES") {
    EXPECT_EQ(meshopt_decodeIndexBuffer(rows.data(), count, stride, data, bytes.size()), 0);
  } else {
    EXPECT_EQ(meshopt_decodeVertexBuffer(rows.data(), count, stride, data, bytes.size()), 0);
  }
  if (packed.value("filter", "") == "OCTAHEDRAL") {
    meshopt_decodeFilterOct(rows.data(), count, stride);
  }
  return rows;
}

struct CompressCase {
  TriangleMesh mesh;
  std::vector<HeightSource> sources;
  PointLayers layers;
};

// At the coordinates of a map.
CompressCase CompressSample() {
  const DisplacedSurface surface = testing::CreasedOctahedron(3);
  CompressCase sample{*Tessellate(surface, 3, RunContext()), SourcesAtLevel(surface, 3), {}};
  for (Eigen::Index v = 0; v < sample.mesh.vertices.cols(); ++v) {
    const auto byte = static_cast<uint8_t>(v);
    sample.layers.colors.push_back({byte, static_cast<uint8_t>(255 - byte), 7});
    sample.layers.intensity.push_back(static_cast<float>(v) / 3);
  }
  return sample;
}

testing::GlbParts CompressedParts(const CompressCase& sample, const ScanPlace& place = {}) {
  std::ostringstream out;
  EXPECT_TRUE(WriteCompressedGlbMesh(sample.mesh, sample.sources, out, sample.layers, place).ok());
  return testing::TakeGlbApart(out.str());
}

// For each row of the file the vertex of the mesh, found by its place.
std::vector<Eigen::Index> VerticesOfParts(const testing::GlbParts& glb, const TriangleMesh& mesh) {
  const Json& node = glb.json["nodes"][1];
  const std::string rows =
      UnpackedRows(glb, glb.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]);
  const Eigen::Vector3d size =
      mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  std::vector<Eigen::Index> vertices;
  for (size_t row = 0; row < rows.size() / 8; ++row) {
    Eigen::Vector3d place;
    for (size_t axis = 0; axis < 3; ++axis) {
      place[static_cast<int>(axis)] =
          LoadAt<uint16_t>(rows, 8 * row + 2 * axis) * node["scale"][axis].get<double>() +
          node["translation"][axis].get<double>();
    }
    Eigen::Index nearest;
    const double distance = (mesh.vertices.colwise() - place).colwise().norm().minCoeff(&nearest);
    EXPECT_LE(distance, std::exp2(-16) * size.norm());
    vertices.push_back(nearest);
  }
  return vertices;
}

TEST(CompressGlbTest, HoldsTheMeshInAnotherOrder) {
  const CompressCase sample = CompressSample();
  const testing::GlbParts glb = CompressedParts(sample, {0.001, UpDirection::kZ, ""});
  const std::vector<Eigen::Index> vertices = VerticesOfParts(glb, sample.mesh);
  EXPECT_EQ(std::set<Eigen::Index>(vertices.begin(), vertices.end()).size(),
            static_cast<size_t>(sample.mesh.vertices.cols()));
  const auto from_least = [](Eigen::Vector3i corners) {
    while (corners[0] != corners.minCoeff())
      corners = Eigen::Vector3i(corners[1], corners[2], corners[0]);
    return std::array<int, 3>{corners[0], corners[1], corners[2]};
  };
  std::multiset<std::array<int, 3>> given, held;
  for (Eigen::Index t = 0; t < sample.mesh.triangles.cols(); ++t) {
    given.insert(from_least(sample.mesh.triangles.col(t)));
  }
  const std::string corners = UnpackedRows(glb, glb.json["meshes"][0]["primitives"][0]["indices"]);
  for (size_t t = 0; t < corners.size() / 12; ++t) {
    Eigen::Vector3i triangle;
    for (size_t k = 0; k < 3; ++k) {
      triangle[static_cast<int>(k)] =
          static_cast<int>(vertices[LoadAt<uint32_t>(corners, 12 * t + 4 * k)]);
    }
    held.insert(from_least(triangle));
  }
  EXPECT_EQ(held, given);
}

TEST(CompressGlbTest, HoldsWhatIsKnownOfTheVertices) {
  const CompressCase sample = CompressSample();
  const testing::GlbParts glb = CompressedParts(sample);
  const Json& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
  const std::vector<Eigen::Index> vertices = VerticesOfParts(glb, sample.mesh);
  const std::string normals = UnpackedRows(glb, attributes["NORMAL"]);
  const std::string sources = UnpackedRows(glb, attributes["_SOURCE"]);
  const std::string colors = UnpackedRows(glb, attributes["COLOR_0"]);
  const std::string intensity = UnpackedRows(glb, attributes["_INTENSITY"]);
  const std::array<uint16_t, 256> linear = GlbColorsFromSrgb();
  constexpr double kNormalError = 0.02;  // half a step of 8 bits in either direction is 0.012
  for (size_t row = 0; row < vertices.size(); ++row) {
    const Eigen::Index v = vertices[row];
    Eigen::Vector3d normal;
    for (size_t axis = 0; axis < 3; ++axis) {
      normal[static_cast<int>(axis)] = LoadAt<int8_t>(normals, 4 * row + axis) / 127.0;
      EXPECT_EQ(LoadAt<uint16_t>(colors, 8 * row + 2 * axis),
                linear[sample.layers.colors[static_cast<size_t>(v)][axis]]);
    }
    EXPECT_LT((normal.normalized() - sample.mesh.normals.col(v)).norm(), kNormalError);
    EXPECT_EQ(LoadAt<uint16_t>(colors, 8 * row + 6), 65535);
    EXPECT_EQ(LoadAt<uint32_t>(sources, 4 * row),
              static_cast<uint32_t>(sample.sources[static_cast<size_t>(v)]));
    EXPECT_EQ(LoadAt<float>(intensity, 4 * row), sample.layers.intensity[static_cast<size_t>(v)]);
  }
}

TEST(CompressGlbTest, SaysWhatAReaderHasToKnow) {
  const testing::GlbParts glb = CompressedParts(CompressSample());
  const Json extensions = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  EXPECT_EQ(glb.json["extensionsUsed"], extensions);
  EXPECT_EQ(glb.json["extensionsRequired"], extensions);
  EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
  EXPECT_EQ(glb.json["buffers"][1]["extensions"]["EXT_meshopt_compression"]["fallback"], true);
  uint64_t unpacked = 0;
  for (const Json& view : glb.json["bufferViews"]) unpacked += view["byteLength"].get<uint64_t>();
  EXPECT_EQ(glb.json["buffers"][1]["byteLength"], unpacked);
  EXPECT_LT(glb.binary.size(), unpacked / 2);
}

TEST(CompressGlbTest, KeepsThePlacesOfATexture) {
  CompressCase sample = CompressSample();
  Eigen::Matrix2Xf places(2, sample.mesh.vertices.cols());
  for (Eigen::Index v = 0; v < places.cols(); ++v) {
    places.col(v) << static_cast<float>(v % 7) / 6, static_cast<float>(v % 11) / 10;
  }
  const std::string png = "no picture";
  const GlbTexture texture{places, png};
  std::ostringstream out;
  ASSERT_TRUE(WriteCompressedGlbMesh(sample.mesh, {}, out, {}, {}, &texture).ok());
  const testing::GlbParts glb = testing::TakeGlbApart(out.str());
  const Json& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
  EXPECT_FALSE(attributes.contains("_SOURCE"));
  const std::string rows = UnpackedRows(glb, attributes["TEXCOORD_0"]);
  const std::vector<Eigen::Index> vertices = VerticesOfParts(glb, sample.mesh);
  for (size_t row = 0; row < vertices.size(); ++row) {
    for (size_t axis = 0; axis < 2; ++axis) {
      EXPECT_NEAR(LoadAt<uint16_t>(rows, 4 * row + 2 * axis) / 65535.0,
                  places(static_cast<int>(axis), vertices[row]), 1e-5);
    }
  }
  const Json& picture = glb.json["bufferViews"][glb.json["images"][0]["bufferView"].get<int>()];
  EXPECT_EQ(
      glb.binary.substr(picture["byteOffset"].get<size_t>(), picture["byteLength"].get<size_t>()),
      png);
}

TEST(CompressGlbTest, IsReadAgain) {
  CompressCase sample = CompressSample();
  sample.layers.intensity.clear();
  const ScanPlace place = {0.01, UpDirection::kMinusX, ""};
  std::stringstream plain, packed;
  ASSERT_TRUE(WriteGlbMesh(sample.mesh, sample.sources, plain, sample.layers, place).ok());
  ASSERT_TRUE(
      WriteCompressedGlbMesh(sample.mesh, sample.sources, packed, sample.layers, place).ok());
  const auto expected = ReadGlbMesh(plain), read = ReadGlbMesh(packed);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->mesh.vertices.cols(), expected->mesh.vertices.cols());
  EXPECT_EQ(read->mesh.triangles.cols(), expected->mesh.triangles.cols());
  for (Eigen::Index v = 0; v < read->mesh.vertices.cols(); ++v) {
    Eigen::Index nearest;
    const double distance = (expected->mesh.vertices.colwise() - read->mesh.vertices.col(v))
                                .colwise()
                                .norm()
                                .minCoeff(&nearest);
    EXPECT_LT(distance, 0.01 * 8 * std::exp2(-16));
    EXPECT_EQ(read->colors[static_cast<size_t>(v)], expected->colors[static_cast<size_t>(nearest)]);
  }
}

// Many views of the same packed bytes would make a small file large.
TEST(CompressGlbTest, PackedBytesAreUnpackedOnce) {
  testing::GlbParts glb = CompressedParts(CompressSample());
  Json& primitives = glb.json["meshes"][0]["primitives"];
  const Json first = primitives[0];
  const int position = first["attributes"]["POSITION"];
  const int view = glb.json["accessors"][position]["bufferView"];
  for (int copy = 0; copy < 20; ++copy) {
    Json accessor = glb.json["accessors"][position];
    accessor["bufferView"] = glb.json["bufferViews"].size();
    glb.json["bufferViews"].push_back(Json(glb.json["bufferViews"][view]));
    Json again = first;
    again["attributes"] = {{"POSITION", glb.json["accessors"].size()}};
    glb.json["accessors"].push_back(accessor);
    primitives.push_back(again);
  }
  std::string text = glb.json.dump(), binary = glb.binary;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto number = [](size_t value) {
    const auto bytes = std::bit_cast<std::array<char, 4>>(static_cast<uint32_t>(value));
    return std::string(bytes.begin(), bytes.end());
  };
  std::istringstream in("glTF" + number(2) + number(28 + text.size() + binary.size()) +
                        number(text.size()) + "JSON" + text + number(binary.size()) +
                        std::string("BIN\0", 4) + binary);
  const auto read = ReadGlbMesh(in);
  EXPECT_TRUE(absl::IsInvalidArgument(read.status()));
  EXPECT_THAT(std::string(read.status().message()), ::testing::HasSubstr("must not overlap"));
}

// What a file may claim of its packed rows.
TEST(UnpackRowsTest, RefusesWhatTheBytesCannotHold) {
  const std::string bytes(10, '\0');
  const auto error = [&](uint64_t rows, uint64_t stride, const char* mode, const char* filter) {
    return UnpackRows({bytes, rows, stride, mode, filter}).status();
  };
  EXPECT_TRUE(absl::IsInvalidArgument(error(1, 4, "POINTS", "NONE")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(1, 5, "ATTRIBUTES", "NONE")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(1, 260, "ATTRIBUTES", "NONE")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(1, 12, "ATTRIBUTES", "OCTAHEDRAL")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(3, 4, "TRIANGLES", "OCTAHEDRAL")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(4, 4, "TRIANGLES", "NONE")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(161, 4, "ATTRIBUTES", "NONE")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(33, 4, "TRIANGLES", "NONE")));
  EXPECT_TRUE(absl::IsInvalidArgument(error(uint64_t{1} << 62, 4, "INDICES", "NONE")));
  EXPECT_TRUE(absl::IsDataLoss(error(3, 4, "TRIANGLES", "NONE")));
  EXPECT_TRUE(absl::IsDataLoss(error(3, 4, "ATTRIBUTES", "EXPONENTIAL")));
}

TEST(CompressGlbTest, LeavesOutVerticesWithoutATriangle) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 5);
  mesh.vertices << 0, 9, 1, 0, 9,  //
      0, 9, 0, 1, 9,               //
      0, 9, 0, 0, 9;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 2, 3;
  std::ostringstream out;
  ASSERT_TRUE(WriteCompressedGlbMesh(mesh, {}, out).ok());
  const testing::GlbParts glb = testing::TakeGlbApart(out.str());
  EXPECT_EQ(glb.json["accessors"][0]["count"], 3);
  EXPECT_EQ(VerticesOfParts(glb, mesh).size(), 3u);
  EXPECT_FALSE(WriteCompressedGlbMesh({}, {}, out).ok());
}

TEST(CompressGlbTest, RoundsToMultiplesOfAGivenStep) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 4.6e6 + 0.26, 4.6e6 + 1.13, 4.6e6 + 0.51,  //
      -0.26, 0.51, 1.13,                                      //
      7, 7, 7;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  const auto write = [&](double step) {
    std::ostringstream out;
    const absl::Status status = WriteCompressedGlbMesh(mesh, {}, out, {}, {}, nullptr, step);
    return status.ok() ? absl::StatusOr<std::string>(out.str()) : status;
  };
  const auto written = write(0.25);
  ASSERT_TRUE(written.ok()) << written.status();
  const testing::GlbParts glb = testing::TakeGlbApart(*written);
  const auto& node = glb.json["nodes"][1];
  EXPECT_EQ(node["scale"], (std::vector<double>{0.25, 0.25, 0.25}));
  EXPECT_EQ(node["translation"], (std::vector<double>{4.6e6 + 0.25, -0.25, 7}));
  EXPECT_EQ(glb.json["accessors"][0]["max"], (std::vector<double>{4, 6, 0}));
  const absl::Status too_fine = write(2e-5).status();
  EXPECT_TRUE(absl::IsInvalidArgument(too_fine));
  EXPECT_THAT(std::string(too_fine.message()), ::testing::HasSubstr("step = 2e-05"));
}

}  // namespace
}  // namespace rilievo
