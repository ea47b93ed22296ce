#include "core/codec/mesh/face_groups.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "core/base/status_macros.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

using Sums = std::vector<std::array<int64_t, 3>>;  // of each face's corners

int LongestAxis(std::span<const int> faces, const Sums& sums) {
  int longest = 0;
  int64_t most = -1;
  for (int axis = 0; axis < 3; ++axis) {
    int64_t low = std::numeric_limits<int64_t>::max(), high = std::numeric_limits<int64_t>::min();
    for (int f : faces) {
      low = std::min(low, sums[f][axis]);
      high = std::max(high, sums[f][axis]);
    }
    if (high - low > most) {
      most = high - low;
      longest = axis;
    }
  }
  return longest;
}

void Halve(std::span<int> faces, const Sums& sums, size_t limit,
           std::vector<std::vector<int>>& members) {
  if (faces.size() <= limit) {
    members.emplace_back(faces.begin(), faces.end());
    std::sort(members.back().begin(), members.back().end());
    return;
  }
  const int axis = LongestAxis(faces, sums);
  const size_t half = faces.size() / 2;
  // Sorted whole: selection may take quadratic time on points that are made for it.
  std::sort(faces.begin(), faces.end(), [&](int a, int b) {
    return std::pair(sums[a][axis], a) < std::pair(sums[b][axis], b);
  });
  Halve(faces.first(half), sums, limit, members);
  Halve(faces.subspan(half), sums, limit, members);
}

}  // namespace

FaceGroups GroupFaces(const MeshTopology& control, const std::vector<GridPoint>& points,
                      int limit) {
  Sums sums(control.face_count());
  for (int f = 0; f < control.face_count(); ++f) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 3; ++k) sums[f][axis] += points[control.faces(k, f)][axis];
    }
  }
  std::vector<int> faces(control.face_count());
  std::iota(faces.begin(), faces.end(), 0);
  FaceGroups groups;
  Halve(faces, sums, static_cast<size_t>(limit), groups.members);
  groups.group_of.resize(faces.size());
  groups.place_of.resize(faces.size());
  for (int g = 0; g < groups.count(); ++g) {
    for (size_t i = 0; i < groups.members[g].size(); ++i) {
      groups.group_of[groups.members[g][i]] = g;
      groups.place_of[groups.members[g][i]] = static_cast<int>(i);
    }
  }
  return groups;
}

absl::StatusOr<GroupMesh> BuildGroupMesh(const MeshTopology& control, const FaceGroups& groups,
                                         int group, int max_level, const RunContext& context) {
  const std::vector<int>& members = groups.members[group];
  FaceCut cut = CutConnectivity(control, members, groups.group_of, groups.place_of);
  ControlMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(cut.vertex_of.size()));
  mesh.faces = std::move(cut.faces);
  GroupMesh made;
  made.group = group;
  RILIEVO_ASSIGN_OR_RETURN(made.refinement, RefineTopology(mesh, max_level - 1, context));
  made.foreign.assign(made.refinement.vertex_count(max_level), 0);
  const FaceVertices vertices(made.refinement.levels[0], max_level);
  const int shared_count = made.refinement.vertex_count(kFirstGroupedLevel - 1);
  std::vector<int> of_face;
  for (size_t f = 0; f < members.size(); ++f) {
    vertices.Of(static_cast<int>(f), of_face);
    for (int side = 0; side < 3; ++side) {
      const int neighbor = control.face_neighbors(side, members[f]);
      if (neighbor < 0 || groups.group_of[neighbor] >= group) continue;
      for (int p : vertices.Side(side)) {
        if (of_face[p] >= shared_count) made.foreign[of_face[p]] = 1;
      }
    }
  }
  return made;
}

std::vector<int> VerticesThere(const FaceVertices& here, const FaceVertices& there,
                               const std::vector<int>& face_there) {
  std::vector<int> vertices(here.count(), -1), from, to;
  for (size_t f = 0; f < face_there.size(); ++f) {
    if (face_there[f] < 0) continue;
    here.Of(static_cast<int>(f), from);
    there.Of(face_there[f], to);
    for (size_t p = 0; p < from.size(); ++p) vertices[from[p]] = to[p];
  }
  return vertices;
}

}  // namespace rilievo
