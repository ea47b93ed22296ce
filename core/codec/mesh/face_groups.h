// The groups of control faces whose heights a file holds apart, so that a region decodes without
// the rest (docs/dss-format.md, Groups).
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/face_vertices.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Levels below are coded for the whole surface at once.
inline constexpr int kFirstGroupedLevel = 2;
// Bounds of what a file may ask for: most faces a group.
inline constexpr int kLeastGroupLimit = 128, kMostGroupLimit = 1 << 20;

struct FaceGroups {
  std::vector<std::vector<int>> members;  // control faces of each group, ascending
  std::vector<int> group_of;              // a control face
  std::vector<int> place_of;              // a control face: within its group
  int count() const { return static_cast<int>(members.size()); }
};

// Halves the faces across their longest extent until no part has more than `limit`: parts are
// compact, and half as large at least. The same on every machine: integers only.
FaceGroups GroupFaces(const MeshTopology& control, const std::vector<GridPoint>& points, int limit);

// One group as a mesh of its own.
struct GroupMesh {
  int group = 0;
  LoopRefinement refinement;     // of its control faces alone, which are members[group] in order
  std::vector<uint8_t> foreign;  // by vertex of level `max_level`: 1 where another group codes it
};

// `control` is the whole control mesh, a manifold; max_level >= kFirstGroupedLevel. A vertex on an
// edge between two groups belongs to the one with the smaller number.
absl::StatusOr<GroupMesh> BuildGroupMesh(const MeshTopology& control, const FaceGroups& groups,
                                         int group, int max_level, const RunContext& context);

// For each vertex of the group's mesh at one level the same vertex of another mesh, -1 where it has
// none. `face_there`: for each control face of the group, its number there or -1. The levels of
// `here` (of the group's control mesh) and `there` are the same.
std::vector<int> VerticesThere(const FaceVertices& here, const FaceVertices& there,
                               const std::vector<int>& face_there);

}  // namespace rilievo
