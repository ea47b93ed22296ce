#include "client/formats/textured_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/formats/glb_writer.h"
#include "tests/unit/formats/surface_samples.h"

namespace rilievo {
namespace {

DisplacedSurface Colored(int level) {
  DisplacedSurface surface = testing::CreasedOctahedron(level);
  for (size_t v = 0; v < surface.heights.size(); ++v) {
    surface.colors.push_back({static_cast<uint8_t>(37 * v), static_cast<uint8_t>(101 * v + 9),
                              static_cast<uint8_t>(v * v)});
  }
  return surface;
}

struct Image {
  int width = 0, height = 0;
  std::vector<Rgb> pixels;

  // As graphics filter: linear between the middles of pixels.
  Eigen::Vector3d Filtered(const Eigen::Vector2f& place) const {
    const double x = place[0] * double{1.0 * width} - 0.5,
                 y = place[1] * double{1.0 * height} - 0.5;
    const int x0 = static_cast<int>(std::floor(x + 1e-4)),
              y0 = static_cast<int>(std::floor(y + 1e-4));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      const int px = std::min(x0 + k % 2, width - 1), py = std::min(y0 + k / 2, height - 1);
      const double weight =
          (k % 2 == 0 ? 1 - (x - x0) : x - x0) * (k / 2 == 0 ? 1 - (y - y0) : y - y0);
      const Rgb& pixel = pixels[static_cast<size_t>(py) * width + px];
      sum += weight * Eigen::Vector3d(pixel[0], pixel[1], pixel[2]);
    }
    return sum;
  }
};

Image Decode(const std::string& png) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&header, png.data(), png.size())) << header.message;
  header.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(header.width), static_cast<int>(header.height), {}};
  image.pixels.resize(static_cast<size_t>(image.width) * image.height);
  EXPECT_TRUE(png_image_finish_read(&header, nullptr, image.pixels.data(), 0, nullptr));
  return image;
}

TEST(TexturedMeshTest, EachVertexFindsItsColour) {
  const DisplacedSurface surface = Colored(3);
  const TexturedMesh textured = *MakeTexturedMesh(surface, 3, 256, RunContext());
  ASSERT_EQ(textured.texture_level, 3);
  const TriangleMesh whole = *Tessellate(surface, 3, RunContext());
  ASSERT_EQ(textured.mesh.triangles.cols(), whole.triangles.cols());
  const Image image = Decode(textured.png);
  EXPECT_LE(std::max(image.width, image.height), 256);
  for (Eigen::Index f = 0; f < whole.triangles.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int v = textured.mesh.triangles(k, f), from = whole.triangles(k, f);
      EXPECT_EQ(textured.mesh.vertices.col(v), whole.vertices.col(from));
      const Rgb color = surface.colors[from];
      const Eigen::Vector3d found = image.Filtered(textured.texture.col(v));
      EXPECT_LT((found - Eigen::Vector3d(color[0], color[1], color[2])).norm(), 0.2);
    }
  }
}

TEST(TexturedMeshTest, SmoothColoursAreLinearAlongAllEdgesOfACoarseLevel) {
  DisplacedSurface surface = testing::CreasedOctahedron(4);
  const TriangleMesh fine = *Tessellate(surface, 4, RunContext());
  const auto color_at = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d unit = (p - surface.frame.center) / surface.frame.diagonal;
    return Eigen::Vector3d(128 + 300 * unit[0], 128 + 250 * unit[1], 128 - 200 * unit[2]);
  };
  for (const auto& p : fine.vertices.colwise()) {
    const Eigen::Vector3d c = color_at(p);
    surface.colors.push_back({static_cast<uint8_t>(std::lround(c[0])),
                              static_cast<uint8_t>(std::lround(c[1])),
                              static_cast<uint8_t>(std::lround(c[2]))});
  }
  const TexturedMesh textured = *MakeTexturedMesh(surface, 1, 256, RunContext());
  const Image image = Decode(textured.png);
  for (Eigen::Index f = 0; f < textured.mesh.triangles.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int v = textured.mesh.triangles(k, f), w = textured.mesh.triangles((k + 1) % 3, f);
      for (const float share : {0.125F, 0.3F, 0.5F, 0.77F}) {
        const Eigen::Vector2f place =
            (1 - share) * textured.texture.col(v) + share * textured.texture.col(w);
        const Eigen::Vector3d chord =
            (1 - share) * textured.mesh.vertices.col(v) + share * textured.mesh.vertices.col(w);
        // The surface bulges from the chord; colours of another face would be tens off.
        EXPECT_LT((image.Filtered(place) - color_at(chord)).norm(), 25);
      }
    }
  }
}

TEST(TexturedMeshTest, SmallPicturesTakeACoarserLevelAndTooSmallOnesAreRefused) {
  const DisplacedSurface surface = Colored(4);
  EXPECT_LT(MakeTexturedMesh(surface, 4, 24, RunContext())->texture_level, 4);
  EXPECT_TRUE(absl::IsInvalidArgument(MakeTexturedMesh(surface, 1, 4, RunContext()).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(MakeTexturedMesh(surface, 5, 64, RunContext()).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(
      MakeTexturedMesh(testing::CreasedOctahedron(2), 1, 64, RunContext()).status()));
}

TEST(TexturedMeshTest, GoesIntoTheGlb) {
  const TexturedMesh textured = *MakeTexturedMesh(Colored(3), 1, 128, RunContext());
  const GlbTexture texture{textured.texture, textured.png};
  std::ostringstream out;
  ASSERT_TRUE(WriteGlbMesh(textured.mesh, textured.sources, out, {}, {}, &texture).ok());
  const std::string bytes = out.str();
  const auto json = nlohmann::json::parse(bytes.substr(20, bytes.find("BIN", 20) - 24));
  const int view = json["images"][0]["bufferView"];
  const size_t offset = json["bufferViews"][view]["byteOffset"];
  const size_t size = json["bufferViews"][view]["byteLength"];
  const size_t binary = bytes.find(std::string("BIN\0", 4)) + 4;
  EXPECT_EQ(bytes.substr(binary + offset, size), textured.png);
  EXPECT_EQ(bytes.size() % 4, 0u);
  EXPECT_EQ(json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
  EXPECT_TRUE(json["meshes"][0]["primitives"][0]["attributes"].contains("TEXCOORD_0"));
}

}  // namespace
}  // namespace rilievo
