// 3D Tiles, taken apart: what the specification asks, and that tiles of a level are the surface.
#include "client/formats/tiles/tileset_writer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "client/formats/mesh_reader.h"
#include "client/formats/tiles/tile_mesh.h"
#include "client/formats/tiles/tile_tree.h"
#include "tests/unit/formats/surface_samples.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kTileLevels = 3;
constexpr int64_t kMostTriangles = 64;  // triangles: one control face at level 3, eight at level 1

std::vector<TriangleMesh> TessellatedLevels(const DisplacedSurface& surface) {
  std::vector<TriangleMesh> levels;
  for (int level = 0; level <= surface.max_level; ++level) {
    levels.push_back(*Tessellate(surface, level, RunContext()));
  }
  return levels;
}

TEST(TileTreeTest, EachLevelHasEveryFaceOnceAndChildrenHaveThoseOfTheirParent) {
  const DisplacedSurface surface = testing::CreasedOctahedron(kTileLevels);
  const auto tiles = CutIntoTiles(surface.control_mesh, kTileLevels, kMostTriangles);
  ASSERT_TRUE(tiles.ok()) << tiles.status();
  std::map<int, std::vector<int>> faces_of_level;
  std::map<int, size_t> tiles_of_level;
  for (const SurfaceTile& tile : *tiles) {
    faces_of_level[tile.level].insert(faces_of_level[tile.level].end(), tile.faces.begin(),
                                      tile.faces.end());
    ++tiles_of_level[tile.level];
    if (tile.children.empty()) {
      EXPECT_EQ(tile.level, kTileLevels);
      continue;
    }
    std::vector<int> below;
    for (const int child : tile.children) {
      const SurfaceTile& other = (*tiles)[static_cast<size_t>(child)];
      EXPECT_EQ(other.level, tile.level + 1);
      below.insert(below.end(), other.faces.begin(), other.faces.end());
    }
    std::sort(below.begin(), below.end());
    EXPECT_EQ(below, tile.faces);
  }
  for (auto& [level, faces] : faces_of_level) {
    std::sort(faces.begin(), faces.end());
    EXPECT_EQ(faces, (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7})) << level;
  }
  EXPECT_EQ(tiles_of_level, (std::map<int, size_t>{{0, 1}, {1, 1}, {2, 2}, {3, 8}}));
}

TEST(TileTreeTest, AnErrorBoundsTheDistanceToTheFinestLevel) {
  const DisplacedSurface surface = testing::CreasedOctahedron(kTileLevels);
  std::vector<SurfaceTile> tiles = *CutIntoTiles(surface.control_mesh, kTileLevels, kMostTriangles);
  const std::vector<TriangleMesh> levels = TessellatedLevels(surface);
  MeasureTiles(levels, &tiles);
  for (const SurfaceTile& tile : tiles) {
    if (tile.level == kTileLevels) {
      EXPECT_EQ(tile.error, 0);
      continue;
    }
    for (const int child : tile.children) {
      EXPECT_LT(tiles[static_cast<size_t>(child)].error, tile.error);
    }
    // The child in the middle of a triangle splits its three edges.
    const auto level = static_cast<size_t>(tile.level);
    double farthest = 0;
    for (const int face : tile.faces) {
      const int per_face = 1 << (2 * tile.level);
      for (int t = face * per_face; t < (face + 1) * per_face; ++t) {
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector3d middle =
              (levels[level].vertices.col(levels[level].triangles(k, t)) +
               levels[level].vertices.col(levels[level].triangles((k + 1) % 3, t))) /
              2;
          double nearest = 1e9;
          for (int corner = 0; corner < 3; ++corner) {
            const int vertex = levels[level + 1].triangles(corner, 4 * t + 3);
            nearest = std::min(nearest, (levels[level + 1].vertices.col(vertex) - middle).norm());
          }
          farthest = std::max(farthest, nearest);
        }
      }
    }
    EXPECT_GE(tile.error, farthest);
    EXPECT_LT(tile.error, 3 * farthest + 1e-12);
  }
}

double DistanceToSegment(const Eigen::Vector3d& point, const Eigen::Vector3d& from,
                         const Eigen::Vector3d& to) {
  const double share = (point - from).dot(to - from) / (to - from).squaredNorm();
  return (point - from - std::clamp(share, 0.0, 1.0) * (to - from)).norm();
}

TEST(TileTreeTest, ASpreadReachesFromTheRimToThatOfAnyLevel) {
  const DisplacedSurface surface = testing::CreasedOctahedron(kTileLevels);
  std::vector<SurfaceTile> tiles = *CutIntoTiles(surface.control_mesh, kTileLevels, kMostTriangles);
  const std::vector<TriangleMesh> levels = TessellatedLevels(surface);
  MeasureTiles(levels, &tiles);
  for (const SurfaceTile& tile : tiles) {
    const auto rim_at = [&](int number) {
      const auto& mesh = levels[static_cast<size_t>(number)];
      return RimOf(SurfaceLevel{mesh, {}, {}, 1 << (2 * number)}, tile);
    };
    const Eigen::Matrix3Xd& own = levels[static_cast<size_t>(tile.level)].vertices;
    for (int other = 0; other <= kTileLevels; ++other) {
      const Eigen::Matrix3Xd& vertices = levels[static_cast<size_t>(other)].vertices;
      const HalfEdges rim = rim_at(other);
      for (const uint64_t half_edge : rim_at(tile.level)) {
        const Eigen::Vector3d point = own.col(static_cast<Eigen::Index>(half_edge >> 32));
        double nearest = 1e9;
        for (const uint64_t to : rim) {
          nearest = std::min(
              nearest, DistanceToSegment(point, vertices.col(static_cast<Eigen::Index>(to >> 32)),
                                         vertices.col(static_cast<Eigen::Index>(to & 0xffffffff))));
        }
        EXPECT_LE(nearest, tile.spread + 1e-12) << tile.level << " beside " << other;
      }
    }
  }
}

using CornerPlace = std::array<double, 3>;
std::multiset<std::array<CornerPlace, 3>> TrianglesByPlace(const TriangleMesh& mesh) {
  std::multiset<std::array<CornerPlace, 3>> triangles;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    std::array<CornerPlace, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d place = mesh.vertices.col(mesh.triangles(k, t));
      corners[static_cast<size_t>(k)] = {place.x(), place.y(), place.z()};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    triangles.insert(corners);
  }
  return triangles;
}

// An octahedron without its face 0: a border of three edges at level 0.
DisplacedSurface OpenSurface() {
  DisplacedSurface surface = testing::CreasedOctahedron(kTileLevels);
  ControlMesh& control = surface.control_mesh;
  control.faces = control.faces.rightCols(7).eval();
  const int count = RefineTopology(control, kTileLevels, RunContext())->vertex_count(kTileLevels);
  surface.heights.resize(static_cast<size_t>(count));
  surface.sources.resize(static_cast<size_t>(count));
  return surface;
}

TEST(TileMeshTest, TilesOfALevelAreTheSurfaceAndSkirtsHangAtSeamsAlone) {
  const DisplacedSurface surface = OpenSurface();
  std::vector<SurfaceTile> tiles = *CutIntoTiles(surface.control_mesh, kTileLevels, kMostTriangles);
  MeasureTiles(TessellatedLevels(surface), &tiles);
  for (int number = 0; number <= kTileLevels; ++number) {
    const TriangleMesh mesh = *Tessellate(surface, number, RunContext());
    const std::vector<HeightSource> sources = SourcesAtLevel(surface, number);
    const SurfaceLevel level{mesh, sources, {}, 1 << (2 * number)};
    HalfEdges rims;
    size_t tiles_here = 0;
    for (const SurfaceTile& tile : tiles) {
      if (tile.level != number) continue;
      const HalfEdges rim = RimOf(level, tile);
      rims.insert(rims.end(), rim.begin(), rim.end());
      ++tiles_here;
    }
    std::sort(rims.begin(), rims.end());
    const size_t border = 3u << number;  // half-edges of the surface's own border
    std::multiset<std::array<CornerPlace, 3>> all;
    size_t skirts = 0;
    for (const SurfaceTile& tile : tiles) {
      if (tile.level != number) continue;
      TileMesh part = MeshOfTile(level, tile, rims);
      EXPECT_EQ(part.sources.size(), static_cast<size_t>(part.mesh.vertices.cols()));
      const auto own = static_cast<Eigen::Index>(tile.faces.size()) << (2 * number);
      skirts += static_cast<size_t>(part.mesh.triangles.cols() - own) / 2;
      part.mesh.triangles.conservativeResize(3, own);
      all.merge(TrianglesByPlace(part.mesh));
    }
    EXPECT_EQ(all, TrianglesByPlace(mesh)) << number;
    EXPECT_EQ(skirts, rims.size() - border) << number;
    if (tiles_here == 1) {
      EXPECT_EQ(skirts, 0u);
    }
  }
}

class TilesetWriterTest : public ::testing::Test {
 protected:
  TilesetWriterTest() {
    std::string name = (fs::temp_directory_path() / "rilievo-tiles-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~TilesetWriterTest() override { fs::remove_all(folder_); }

  Json Written(const DisplacedSurface& surface, const ScanPlace& place, bool compressed = false) {
    const auto written = WriteTileset(folder_, surface, place,
                                      {.finest_level = surface.max_level,
                                       .compressed = compressed,
                                       .most_triangles = kMostTriangles},
                                      RunContext());
    EXPECT_TRUE(written.ok()) << written.status();
    int64_t bytes = 0, files = 0;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      bytes += static_cast<int64_t>(entry.file_size());
      ++files;
    }
    EXPECT_EQ(written->bytes, bytes);
    EXPECT_EQ(written->tiles, files - 1);
    EXPECT_EQ(written->triangles, 8 << (2 * surface.max_level));
    std::ifstream in(fs::path(folder_) / "tileset.json");
    return Json::parse(in);
  }

  std::string folder_;
};

Eigen::AlignedBox3d BoxOfTile(const Json& tile) {
  const auto box = tile["boundingVolume"]["box"].get<std::vector<double>>();
  EXPECT_EQ(box.size(), 12u);
  const Eigen::Vector3d center(box[0], box[1], box[2]), half(box[3], box[7], box[11]);
  return {center - half, center + half};
}

// Of the tile and those below: geometric errors, boxes and contents.
void CheckTile(const Json& tile, const fs::path& folder, const Eigen::Vector3d& middle,
               double metres, double shown) {
  EXPECT_EQ(tile["refine"], "REPLACE");
  const double error = tile["geometricError"];
  Eigen::AlignedBox3d box = BoxOfTile(tile);
  box.min().array() -= 1e-5;
  box.max().array() += 1e-5;
  const auto content = ReadMesh((folder / tile["content"]["uri"].get<std::string>()).string());
  ASSERT_TRUE(content.ok()) << content.status();
  // ReadMesh() leaves a GLB as it stands: y up and in metres, about the middle of the surface.
  for (Eigen::Index v = 0; v < content->mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d p = content->mesh.vertices.col(v);
    EXPECT_TRUE(box.contains(Eigen::Vector3d(p.x(), -p.z(), p.y()))) << p.transpose();
  }
  if (!tile.contains("children")) {
    EXPECT_EQ(error, 0);
    EXPECT_GT(shown, 0);
    return;
  }
  EXPECT_GT(error, 0);
  EXPECT_LT(error, shown);
  for (const Json& child : tile["children"]) {
    EXPECT_TRUE(box.contains(BoxOfTile(child)));
    CheckTile(child, folder, middle, metres, error);
  }
}

TEST_F(TilesetWriterTest, HoldsWhatTheSpecificationAsksFor) {
  const DisplacedSurface surface = testing::CreasedOctahedron(kTileLevels);
  const Json tileset = Written(surface, {0.01, UpDirection::kZ, "EPSG:25832"});
  EXPECT_EQ(tileset["asset"]["version"], "1.1");
  EXPECT_EQ(tileset["asset"]["extras"]["crs"], "EPSG:25832");
  const Json& root = tileset["root"];
  const auto transform = root["transform"].get<std::vector<double>>();
  ASSERT_EQ(transform.size(), 16u);
  EXPECT_DOUBLE_EQ(transform[12], 4.6e4);
  EXPECT_DOUBLE_EQ(transform[13], 5.5e4);
  EXPECT_DOUBLE_EQ(transform[14], 3);
  EXPECT_GE(tileset["geometricError"], root["geometricError"]);
  CheckTile(root, folder_, surface.frame.center, 0.01, tileset["geometricError"]);
}

TEST_F(TilesetWriterTest, BringsTheWayUpToZ) {
  const DisplacedSurface surface = testing::CreasedOctahedron(1);
  const auto to = Written(surface, {1, UpDirection::kY, ""})["root"]["transform"];
  EXPECT_NEAR(to[12].get<double>(), 4.6e6, 1e-6);
  EXPECT_NEAR(to[13].get<double>(), -300, 1e-6);
  EXPECT_NEAR(to[14].get<double>(), 5.5e6, 1e-6);
}

TEST_F(TilesetWriterTest, HasATileWithoutContentAboveManyCoarseOnes) {
  DisplacedSurface surface = testing::CreasedOctahedron(1);
  const auto written =
      WriteTileset(folder_, surface, {}, {.finest_level = 1, .most_triangles = 4}, RunContext());
  ASSERT_TRUE(written.ok()) << written.status();
  EXPECT_EQ(written->tiles, 2 + 8);
  std::ifstream in(fs::path(folder_) / "tileset.json");
  const Json root = Json::parse(in)["root"];
  EXPECT_FALSE(root.contains("content"));
  EXPECT_EQ(root["children"].size(), 2u);
  for (const Json& child : root["children"]) {
    EXPECT_TRUE(BoxOfTile(root).contains(BoxOfTile(child)));
    EXPECT_LT(child["geometricError"], root["geometricError"]);
  }
}

TEST_F(TilesetWriterTest, CompressesItsTiles) {
  const DisplacedSurface surface = testing::CreasedOctahedron(kTileLevels);
  const Json tileset = Written(surface, {}, true);
  std::ifstream in(fs::path(folder_) / tileset["root"]["content"]["uri"].get<std::string>());
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  EXPECT_NE(bytes.find("EXT_meshopt_compression"), std::string::npos);
}

// Of the tiles at `level` in a tileset, whose root is at level 0.
void AppendTiles(const Json& tile, int level, const fs::path& folder,
                 std::vector<Eigen::Matrix3Xd>* vertices) {
  if (level == 0) {
    const auto mesh = ReadMesh((folder / tile["content"]["uri"].get<std::string>()).string());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    vertices->push_back(mesh->mesh.vertices);
    return;
  }
  for (const Json& child : tile["children"]) AppendTiles(child, level - 1, folder, vertices);
}

TEST_F(TilesetWriterTest, TilesOfALevelMeetAtTheSameVertices) {
  const DisplacedSurface surface = testing::CreasedOctahedron(kTileLevels);
  for (const bool compressed : {false, true}) {
    const Json tileset = Written(surface, {}, compressed);
    // Floats about the middle of a tile; or whole steps, which are the same in all.
    const double same = compressed ? 1e-12 : 1e-6;
    for (int level = 2; level <= kTileLevels; ++level) {
      std::vector<Eigen::Matrix3Xd> tiles;
      AppendTiles(tileset["root"], level, folder_, &tiles);
      ASSERT_GT(tiles.size(), 1u);
      int met = 0;
      for (const Eigen::Matrix3Xd& tile : tiles) {
        for (const Eigen::Matrix3Xd& other : tiles) {
          if (&tile == &other) continue;
          for (Eigen::Index v = 0; v < tile.cols(); ++v) {
            const double nearest = (other.colwise() - tile.col(v)).colwise().norm().minCoeff();
            if (nearest <= same) ++met;
            // Edges are longer than a tenth; grids of their own moved vertices by 1e-5.
            EXPECT_TRUE(nearest <= same || nearest > 2e-3) << nearest;
          }
        }
      }
      EXPECT_GT(met, 0);
    }
  }
}

TEST_F(TilesetWriterTest, ReplacesTheTilesetThatIsThere) {
  Written(testing::CreasedOctahedron(kTileLevels), {});
  std::ofstream(fs::path(folder_) / "notes.txt") << "mine";
  const auto written = WriteTileset(folder_, testing::CreasedOctahedron(1), {}, {}, RunContext());
  ASSERT_TRUE(written.ok()) << written.status();
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_)) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"notes.txt", "tile_0.glb", "tileset.json"}));
}

TEST_F(TilesetWriterTest, LeavesTheTilesOfOthers) {
  for (const char* json : {"{\"asset\":{\"version\":\"1.1\"}}", "[1]", "not JSON"}) {
    std::ofstream(fs::path(folder_) / "tileset.json") << json;
    std::ofstream(fs::path(folder_) / "tile_1.glb") << "of another program";
    const auto written = WriteTileset(folder_, testing::CreasedOctahedron(1), {}, {}, RunContext());
    ASSERT_TRUE(written.ok()) << written.status();
    EXPECT_TRUE(fs::exists(fs::path(folder_) / "tile_1.glb")) << json;
  }
}

TEST_F(TilesetWriterTest, AFailureLeavesNoTileset) {
  Written(testing::CreasedOctahedron(1), {});
  fs::remove(fs::path(folder_) / "tile_1.glb");
  fs::create_directories(fs::path(folder_) / "tile_1.glb" / "in the way");
  const auto written =
      WriteTileset(folder_, testing::CreasedOctahedron(1), {}, {.finest_level = 1}, RunContext());
  EXPECT_FALSE(written.ok());
  EXPECT_FALSE(fs::exists(fs::path(folder_) / "tileset.json"));
}

TEST_F(TilesetWriterTest, RefusesLevelsWithoutHeights) {
  const DisplacedSurface surface = testing::CreasedOctahedron(1);
  EXPECT_TRUE(absl::IsInvalidArgument(
      WriteTileset(folder_, surface, {}, {.finest_level = 2}, RunContext()).status()));
}

}  // namespace
}  // namespace rilievo
