#include "client/formats/tiles/tile_mesh.h"

#include <algorithm>
#include <unordered_map>

namespace rilievo {
namespace {

uint64_t HalfEdge(int from, int to) {
  return uint64_t{static_cast<uint32_t>(from)} << 32 | static_cast<uint32_t>(to);
}
int FromOf(uint64_t half_edge) { return static_cast<int>(half_edge >> 32); }
int ToOf(uint64_t half_edge) { return static_cast<int>(half_edge & 0xffffffff); }

bool HasOpposite(const HalfEdges& half_edges, uint64_t half_edge) {
  return std::binary_search(half_edges.begin(), half_edges.end(),
                            HalfEdge(ToOf(half_edge), FromOf(half_edge)));
}

// Calls visit(triangle) for the triangles of the tile.
template <typename Visit>
void ForEachTriangle(const SurfaceLevel& level, const SurfaceTile& tile, const Visit& visit) {
  for (const int face : tile.faces) {
    const Eigen::Index first = Eigen::Index{face} * level.triangles_per_face;
    for (Eigen::Index t = first; t < first + level.triangles_per_face; ++t) {
      visit(Eigen::Vector3i(level.mesh.triangles.col(t)));
    }
  }
}

// Vertices of a level under the numbers of a tile.
class TileVertices {
 public:
  explicit TileVertices(const SurfaceLevel& level) : level_(level) {}

  int Local(int vertex) {
    const auto [entry, is_new] = local_.try_emplace(vertex, static_cast<int>(places_.size()));
    if (is_new) Append(vertex, level_.mesh.vertices.col(vertex));
    return entry->second;
  }
  // The same vertex, drawn out.
  int Lowered(int vertex, double depth) {
    const auto [entry, is_new] = lowered_.try_emplace(vertex, static_cast<int>(places_.size()));
    if (is_new) {
      Append(vertex, level_.mesh.vertices.col(vertex) - depth * level_.mesh.normals.col(vertex));
    }
    return entry->second;
  }

  void Finish(TileMesh* tile) const {
    const auto count = static_cast<Eigen::Index>(places_.size());
    tile->mesh.vertices.resize(3, count);
    tile->mesh.normals.resize(3, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const int vertex = vertices_[static_cast<size_t>(i)];
      tile->mesh.vertices.col(i) = places_[static_cast<size_t>(i)];
      tile->mesh.normals.col(i) = level_.mesh.normals.col(vertex);
      tile->sources.push_back(level_.sources[static_cast<size_t>(vertex)]);
      if (level_.colors.empty()) continue;
      tile->layers.colors.push_back(level_.colors[static_cast<size_t>(vertex)]);
    }
  }

 private:
  void Append(int vertex, const Eigen::Vector3d& place) {
    vertices_.push_back(vertex);
    places_.push_back(place);
  }

  const SurfaceLevel& level_;
  std::unordered_map<int, int> local_, lowered_;
  std::vector<int> vertices_;  // of the level
  std::vector<Eigen::Vector3d> places_;
};

}  // namespace

HalfEdges RimOf(const SurfaceLevel& level, const SurfaceTile& tile) {
  HalfEdges all;
  ForEachTriangle(level, tile, [&](const Eigen::Vector3i& corners) {
    for (int k = 0; k < 3; ++k) all.push_back(HalfEdge(corners[k], corners[(k + 1) % 3]));
  });
  std::sort(all.begin(), all.end());
  HalfEdges rim;
  for (const uint64_t half_edge : all) {
    if (!HasOpposite(all, half_edge)) rim.push_back(half_edge);
  }
  return rim;
}

TileMesh MeshOfTile(const SurfaceLevel& level, const SurfaceTile& tile, const HalfEdges& rims) {
  TileVertices vertices(level);
  std::vector<Eigen::Vector3i> triangles;
  ForEachTriangle(level, tile, [&](const Eigen::Vector3i& corners) {
    triangles.emplace_back(vertices.Local(corners[0]), vertices.Local(corners[1]),
                           vertices.Local(corners[2]));
  });
  for (const uint64_t half_edge : RimOf(level, tile)) {
    if (!HasOpposite(rims, half_edge)) continue;
    const int from = vertices.Local(FromOf(half_edge)), to = vertices.Local(ToOf(half_edge));
    const int low_from = vertices.Lowered(FromOf(half_edge), tile.spread);
    const int low_to = vertices.Lowered(ToOf(half_edge), tile.spread);
    triangles.emplace_back(to, from, low_from);
    triangles.emplace_back(to, low_from, low_to);
  }
  TileMesh made;
  vertices.Finish(&made);
  made.mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t) {
    made.mesh.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  }
  return made;
}

}  // namespace rilievo
