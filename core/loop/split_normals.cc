#include "core/loop/split_normals.h"

#include <array>
#include <span>

#include "core/base/status_macros.h"
#include "core/loop/edge_star.h"

namespace rilievo {
namespace {

// The face corners around the new vertex of an interior edge, on the next level, from neighbour
// `to` of RingOfEdgeVertex on. Children are numbered as refinement.h says.
std::array<uint32_t, 6> CornersOfEdgeVertex(const MeshTopology& parent, int edge) {
  std::array<uint32_t, 6> corners;
  for (int side = 0; side < 2; ++side) {
    const int f = parent.edge_faces(side, edge), k = CornerOfEdge(parent, f, edge);
    const uint32_t first_child = 4u * static_cast<uint32_t>(f);
    const auto corner = [&](int child, int at) {
      return 3u * (first_child + static_cast<uint32_t>(child)) + static_cast<uint32_t>(at);
    };
    corners[3 * side] = corner(kNextCorner[k], k);
    corners[3 * side + 1] = corner(3, kPreviousCorner[k]);
    corners[3 * side + 2] = corner(k, kNextCorner[k]);
  }
  return corners;
}

// Corner k of a face is corner k of its child k, and so on: after `steps` levels it belongs to face
// 4^steps f + k (4^steps - 1) / 3.
uint32_t CornerAfter(uint32_t half_edge, int steps) {
  const uint32_t faces = uint32_t{1} << (2 * steps), k = half_edge % 3;
  return 3u * (half_edge / 3 * faces + k * ((faces - 1) / 3)) + k;
}

// `corners`: of the whole ring of a vertex that `steps` levels before was first held.
void AddSectors(int vertex, const SharpLimitMask& mask, std::span<const uint32_t> corners,
                int steps, SharpSectors& sectors) {
  if (mask.sectors.size() < 2) return;
  for (const SharpSector& sector : mask.sectors) {
    for (int i = 0; i < sector.face_count; ++i) {
      sectors.half_edges.push_back(
          CornerAfter(corners[(sector.first + i) % corners.size()], steps));
    }
    sectors.vertices.push_back(vertex);
    sectors.begin.push_back(static_cast<int>(sectors.half_edges.size()));
  }
}

}  // namespace

absl::StatusOr<SharpSectors> SectorsOfLevel(const LoopRefinement& refinement, int level) {
  RILIEVO_RETURN_IF_ERROR(CheckLimitLevel(refinement, level));
  SharpSectors sectors;
  if (refinement.sharp.empty()) return sectors;
  for (const SharpControlVertex& sharp : refinement.sharp.control) {
    AddSectors(sharp.vertex, sharp.limit, sharp.half_edges, level, sectors);
  }
  SharpEdgeLimits limits;
  for (int l = 0; l < level; ++l) {
    const MeshTopology& parent = refinement.levels[l];
    for (const SharpEdge& sharp : refinement.sharp.levels[l].edges) {
      if (!StartsSharp(sharp)) continue;
      AddSectors(parent.vertex_count + sharp.edge, limits.Of(sharp),
                 CornersOfEdgeVertex(parent, sharp.edge), level - l - 1, sectors);
    }
  }
  return sectors;
}

}  // namespace rilievo
