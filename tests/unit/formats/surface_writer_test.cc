// The cage, the atlas and USD; how USD text is made is also read by tests/python/check_usda.py.
#include "client/formats/surface_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "client/formats/mesh_reader.h"
#include "client/picture/gray_image.h"
#include "tests/unit/formats/surface_samples.h"

namespace rilievo {
namespace {

using testing::CreasedOctahedron;
using ::testing::HasSubstr;

TEST(ObjCageTest, IsTheControlMeshWithItsTags) {
  const DisplacedSurface surface = CreasedOctahedron(1);
  std::stringstream text;
  ASSERT_TRUE(WriteObjCage(surface.control_mesh, surface.frame, text).ok());
  EXPECT_THAT(text.str(), HasSubstr("t crease 2/1/0 0 1 10\nt crease 2/1/0 0 3 1.5\n"));
  EXPECT_THAT(text.str(), HasSubstr("t corner 1/1/0 4 10\n"));
  const auto read = ReadObjMesh(text);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(read->mesh.triangles == surface.control_mesh.faces);
  for (int v = 0; v < 6; ++v) {
    EXPECT_TRUE(read->mesh.vertices.col(v) ==
                surface.frame.ScanFromUnit(surface.control_mesh.vertices.col(v)));
  }
}

// The numbers of "NAME = [...]".
std::vector<double> UsdNumbers(const std::string& usd, const std::string& name) {
  const size_t at = usd.find(name + " = [");
  if (at == std::string::npos) return {};
  const size_t begin = usd.find('[', at + name.size()) + 1;
  std::string list = usd.substr(begin, usd.find(']', begin) - begin);
  for (char& c : list) {
    if (c == ',' || c == '(' || c == ')') c = ' ';
  }
  std::istringstream in(list);
  return {std::istream_iterator<double>(in), {}};
}

TEST(UsdWriterTest, TheCageAtALevelHasTheSameLimitAndItsHeights) {
  const DisplacedSurface surface = CreasedOctahedron(3);
  const TriangleMesh expected = *Tessellate(surface, 3, RunContext());
  for (int level = 0; level <= 2; ++level) {
    SCOPED_TRACE(level);
    std::ostringstream out;
    ASSERT_TRUE(WriteUsdSurface(surface, level, {}, RunContext(), out).ok());
    const std::string usd = out.str();
    const std::vector<double> points = UsdNumbers(usd, "points");
    const std::vector<double> faces = UsdNumbers(usd, "faceVertexIndices");
    const std::vector<double> ends = UsdNumbers(usd, "creaseIndices");
    const std::vector<double> sharpness = UsdNumbers(usd, "creaseSharpnesses");
    const std::vector<double> heights = UsdNumbers(usd, "primvars:displacement");
    // A surface of its own from the text alone, its limit sampled where the other one's is.
    DisplacedSurface again;
    again.frame = surface.frame;
    again.max_level = 3 - level;
    again.control_mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(
        points.data(), 3, static_cast<Eigen::Index>(points.size() / 3));
    again.control_mesh.vertices /= surface.frame.diagonal;
    again.control_mesh.faces = Eigen::Map<const Eigen::Matrix3Xd>(
                                   faces.data(), 3, static_cast<Eigen::Index>(faces.size() / 3))
                                   .cast<int>();
    std::map<std::pair<int, int>, float> creases;
    for (size_t i = 0; i < sharpness.size(); ++i) {
      creases[std::minmax(static_cast<int>(ends[2 * i]), static_cast<int>(ends[2 * i + 1]))] =
          static_cast<float>(sharpness[i]);
    }
    for (const auto& [edge, sharp] : creases) {
      again.control_mesh.creases.push_back({edge.first, edge.second, sharp});
    }
    again.control_mesh.corners = {4};
    again.heights = surface.heights;  // vertices of a refined refinement are numbered alike
    again.sources = surface.sources;
    const auto mesh = Tessellate(again, 3 - level, RunContext());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_TRUE(mesh->triangles == expected.triangles);
    EXPECT_LT((mesh->vertices - expected.vertices).cwiseAbs().maxCoeff(), 2e-6);
    ASSERT_EQ(heights.size(), points.size() / 3);
    for (size_t v = 0; v < heights.size(); ++v) {
      EXPECT_EQ(static_cast<float>(heights[v]), surface.heights[v] * 8);
    }
  }
  std::ostringstream out;
  EXPECT_FALSE(WriteUsdSurface(surface, 4, {}, RunContext(), out).ok());
  EXPECT_FALSE(WriteUsdSurface(surface, -1, {}, RunContext(), out).ok());
}

TEST(UsdWriterTest, TellsUnitAndUp) {
  const DisplacedSurface surface = CreasedOctahedron(1);
  const auto written = [&](const ScanPlace& place) {
    std::ostringstream out;
    EXPECT_TRUE(WriteUsdSurface(surface, 0, place, RunContext(), out).ok());
    return out.str();
  };
  const std::string unknown = written({});
  EXPECT_THAT(unknown, HasSubstr("metersPerUnit = 1\n"));
  EXPECT_THAT(unknown, HasSubstr("upAxis = \"Z\""));
  EXPECT_THAT(unknown, ::testing::Not(HasSubstr("xformOp:orient")));
  const std::string y_up = written({0.001, UpDirection::kY, ""});
  EXPECT_THAT(y_up, HasSubstr("metersPerUnit = 0.001\n"));
  EXPECT_THAT(y_up, HasSubstr("upAxis = \"Y\""));
  EXPECT_THAT(y_up, ::testing::Not(HasSubstr("xformOp:orient")));
  const std::string turned = written({1, UpDirection::kMinusY, ""});
  EXPECT_THAT(turned, HasSubstr("upAxis = \"Y\""));
  EXPECT_THAT(turned, HasSubstr("quatd xformOp:orient = (0, 1, 0, 0)\n"));
  EXPECT_THAT(turned, HasSubstr("xformOpOrder = [\"xformOp:orient\", \"xformOp:translate\"]"));
}

GrayImage DecodeGray(const std::string& png) {
  png_image header;
  std::memset(&header, 0, sizeof(header));
  header.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&header, png.data(), png.size())) << header.message;
  EXPECT_TRUE((header.format & PNG_FORMAT_FLAG_LINEAR) != 0) << "16 bits";
  header.format = PNG_FORMAT_LINEAR_Y;
  GrayImage image{static_cast<int>(header.width), static_cast<int>(header.height), {}, {}};
  image.samples.resize(static_cast<size_t>(image.width) * image.height);
  EXPECT_TRUE(png_image_finish_read(&header, nullptr, image.samples.data(), 0, nullptr));
  return image;
}

std::string TextOf(const std::string& png, const std::string& keyword) {
  const std::string start = "tEXt" + keyword + std::string(1, '\0');
  const size_t at = png.find(start);
  if (at == std::string::npos) return "";
  const auto byte = [&](size_t i) { return static_cast<uint8_t>(png[at - 4 + i]); };
  const size_t length = size_t{byte(0)} << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
  return png.substr(at + start.size(), length - (start.size() - 4));
}

// Where each vertex lies when faces are halved and stay flat: the lattice of the atlas.
Eigen::Matrix3Xd FlatPositions(const DisplacedSurface& surface, int level) {
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, level, RunContext());
  Eigen::Matrix3Xd points = surface.control_mesh.vertices;
  for (int l = 0; l < level; ++l) {
    const MeshTopology& topology = refinement.levels[l];
    Eigen::Matrix3Xd finer(3, points.cols() + topology.edge_count());
    finer.leftCols(points.cols()) = points;
    for (int e = 0; e < topology.edge_count(); ++e) {
      finer.col(points.cols() + e) =
          (points.col(topology.edge_vertices(0, e)) + points.col(topology.edge_vertices(1, e))) / 2;
    }
    points = std::move(finer);
  }
  return points;
}

TEST(DisplacementAtlasTest, EverySampleIsTheHeightAtItsPlaceInTheFace) {
  const DisplacedSurface surface = CreasedOctahedron(3);
  for (int level = 0; level <= 3; ++level) {
    SCOPED_TRACE(level);
    std::ostringstream out;
    ASSERT_TRUE(WriteDisplacementAtlas(surface, level, RunContext(), out).ok());
    const GrayImage image = DecodeGray(out.str());
    const int n = 1 << level, columns = std::stoi(TextOf(out.str(), "Columns"));
    const double least = std::stod(TextOf(out.str(), "Minimum"));
    const double range = std::stod(TextOf(out.str(), "Maximum")) - least;
    EXPECT_EQ(columns, 2);  // four tiles
    ASSERT_EQ(image.width, 2 * (n + 2));
    ASSERT_EQ(image.height, 2 * (n + 1));
    const Eigen::Matrix3Xd flat = FlatPositions(surface, level);
    const auto height_at = [&](const Eigen::Vector3d& place) {
      Eigen::Index nearest;
      EXPECT_LT((flat.colwise() - place).colwise().norm().minCoeff(&nearest), 1e-12);
      return static_cast<double>(surface.heights[static_cast<size_t>(nearest)]) *
             surface.frame.diagonal;
    };
    for (int face = 0; face < 8; ++face) {
      const auto corner = [&](int k) -> Eigen::Vector3d {
        return surface.control_mesh.vertices.col(surface.control_mesh.faces(k, face));
      };
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; i + j <= n; ++j) {
          // As docs/displacement-atlas.md says it.
          const int tile = face / 2;
          const int x = tile % columns * (n + 2) + (face % 2 == 0 ? i : n + 1 - i);
          const int y = tile / columns * (n + 1) + (face % 2 == 0 ? j : n - j);
          const double sample = image.samples[static_cast<size_t>(y * image.width + x)];
          const Eigen::Vector3d place =
              corner(0) + (corner(1) - corner(0)) * i / n + (corner(2) - corner(0)) * j / n;
          EXPECT_NEAR(least + sample / 65535 * range, height_at(place), 0.51 * range / 65535)
              << face << ' ' << i << ' ' << j;
        }
      }
    }
  }
  std::ostringstream out;
  EXPECT_FALSE(WriteDisplacementAtlas(surface, 4, RunContext(), out).ok());
}

TEST(DisplacementAtlasTest, EqualHeightsAreZeroEverywhere) {
  DisplacedSurface surface = CreasedOctahedron(1);
  surface.heights.assign(surface.heights.size(), 0.25f);
  std::ostringstream out;
  ASSERT_TRUE(WriteDisplacementAtlas(surface, 1, RunContext(), out).ok());
  EXPECT_EQ(TextOf(out.str(), "Minimum"), "2");
  EXPECT_EQ(TextOf(out.str(), "Maximum"), "2");
  EXPECT_THAT(DecodeGray(out.str()).samples, ::testing::Each(0));
}

TEST(GrayPngTest, RefusesSamplesThatDoNotFit) {
  EXPECT_FALSE(EncodePng(GrayImage{2, 2, {1, 2, 3}, {}}).ok());
  EXPECT_FALSE(EncodePng(GrayImage{0, 0, {}, {}}).ok());
}

}  // namespace
}  // namespace rilievo
