#include "core/meshes/split_edges.h"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

constexpr size_t kWideFan = 64;
constexpr int64_t kMostFaces = int64_t{1} << 28;

using Corners = std::array<int, 3>;

// A mesh that grows.
struct GrowingMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Corners> faces;

  int AddBetween(int a, int b, double share_of_b = 0.5) {
    vertices.push_back((1 - share_of_b) * vertices[a] + share_of_b * vertices[b]);
    return static_cast<int>(vertices.size()) - 1;
  }
};

GrowingMesh Growing(const ControlMesh& mesh) {
  GrowingMesh grown;
  for (const auto vertex : mesh.vertices.colwise()) grown.vertices.push_back(vertex);
  for (const auto face : mesh.faces.colwise()) grown.faces.push_back({face[0], face[1], face[2]});
  return grown;
}

Eigen::Matrix3Xi FacesOf(const GrowingMesh& grown) {
  Eigen::Matrix3Xi faces(3, static_cast<int64_t>(grown.faces.size()));
  for (size_t f = 0; f < grown.faces.size(); ++f) {
    faces.col(static_cast<int64_t>(f)) = Eigen::Map<const Eigen::Vector3i>(grown.faces[f].data());
  }
  return faces;
}

ControlMesh Grown(const GrowingMesh& grown) {
  ControlMesh mesh{Eigen::Matrix3Xd(3, static_cast<int64_t>(grown.vertices.size())),
                   FacesOf(grown)};
  for (size_t v = 0; v < grown.vertices.size(); ++v) {
    mesh.vertices.col(static_cast<int64_t>(v)) = grown.vertices[v];
  }
  return mesh;
}

// The faces of a wide fan around `tip` become rings: every other spoke, and the two at a border,
// get a vertex half way, the ring inside has these, until it is no longer wide. `fan`: the faces,
// each with the corner of the tip, counter-clockwise.
void SplitFan(int tip, const std::vector<std::pair<int, int>>& fan, bool is_closed,
              GrowingMesh* mesh) {
  std::vector<int> outer;  // around, of a closed fan without the first once more
  for (const auto& [face, corner] : fan) outer.push_back(mesh->faces[face][kNextCorner[corner]]);
  if (!is_closed) {
    const auto& [face, corner] = fan.back();
    outer.push_back(mesh->faces[face][kPreviousCorner[corner]]);
  }
  size_t reused = 0;  // of the faces of the fan
  const auto add = [&](int a, int b, int c) {
    if (reused < fan.size()) {
      mesh->faces[fan[reused++].first] = {a, b, c};
    } else {
      mesh->faces.push_back({a, b, c});
    }
  };
  while (outer.size() > kWideFan) {
    double around = 0;
    for (size_t i = 0; i + 1 < outer.size(); ++i) {
      around += (mesh->vertices[outer[i + 1]] - mesh->vertices[outer[i]]).norm();
    }
    const double inward = 2 * around / static_cast<double>(outer.size() - 1);
    std::vector<int> inner;
    std::vector<size_t> below;  // by vertex of `outer`: the last of `inner` at or before it
    for (size_t i = 0; i < outer.size(); ++i) {
      if (i % 2 == 0 || (!is_closed && i + 1 == outer.size())) {
        const double spoke = (mesh->vertices[tip] - mesh->vertices[outer[i]]).norm();
        inner.push_back(mesh->AddBetween(outer[i], tip, inward < spoke / 2 ? inward / spoke : 0.5));
      }
      below.push_back(inner.size() - 1);
    }
    const size_t count = is_closed ? outer.size() : outer.size() - 1;
    for (size_t i = 0; i < count; ++i) {
      const size_t next = (i + 1) % outer.size();
      const int from = inner[below[i]], to = inner[below[next]];
      add(outer[i], outer[next], from);
      if (from != to) add(outer[next], to, from);
    }
    outer = std::move(inner);
  }
  const size_t count = is_closed ? outer.size() : outer.size() - 1;
  for (size_t i = 0; i < count; ++i) add(tip, outer[i], outer[(i + 1) % outer.size()]);
}

// Whether one was split. Of fans that share a face one waits for a later call.
absl::StatusOr<bool> SplitWideFans(GrowingMesh* mesh) {
  const auto topology = BuildMeshTopology(FacesOf(*mesh), static_cast<int>(mesh->vertices.size()));
  if (!topology.ok()) return topology.status();
  std::vector<uint8_t> touched(mesh->faces.size(), 0);
  std::vector<int> first(mesh->vertices.size(), -1);  // a corner whose face begins the fan
  for (int f = 0; f < topology->face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      int& corner = first[topology->faces(k, f)];
      if (corner < 0 || topology->face_neighbors(k, f) < 0) corner = 3 * f + k;
    }
  }
  bool has_split = false;
  for (int tip = 0; tip < static_cast<int>(first.size()); ++tip) {
    if (topology->valence[tip] <= static_cast<int>(kWideFan)) continue;
    std::vector<std::pair<int, int>> fan;
    bool is_free = true, is_closed = true;
    for (int face = first[tip] / 3, k = first[tip] % 3;;) {
      fan.emplace_back(face, k);
      is_free = is_free && touched[face] == 0;
      const int edge = topology->face_edges(kPreviousCorner[k], face);
      const int next = topology->face_neighbors(kPreviousCorner[k], face);
      is_closed = next >= 0;
      if (next < 0 || next == first[tip] / 3) break;
      k = CornerOfEdge(*topology, next, edge);
      face = next;
    }
    if (!is_free) continue;
    for (const auto& [face, corner] : fan) touched[face] = 1;
    SplitFan(tip, fan, is_closed, mesh);
    has_split = true;
  }
  return has_split;
}

// The faces of one with vertices in the middle of some edges; -1: in none.
void CutFace(int face, const Corners& middle, GrowingMesh* mesh) {
  const Corners old = mesh->faces[face];
  const auto count = (middle[0] >= 0) + (middle[1] >= 0) + (middle[2] >= 0);
  if (count == 0) return;
  // Turned so that the first edge is the one halved of one, and the last the one left of two.
  int turn = 0;
  while (count == 1 ? middle[turn] < 0 : count == 2 && middle[kPreviousCorner[turn]] >= 0) ++turn;
  const int n = kNextCorner[turn], p = kPreviousCorner[turn];
  const int a = old[turn], b = old[n], c = old[p];
  const int ab = middle[turn], bc = middle[n], ca = middle[p];
  if (count == 1) {
    mesh->faces[face] = {a, ab, c};
    mesh->faces.push_back({ab, b, c});
    return;
  }
  mesh->faces[face] = {ab, b, bc};
  if (count == 3) {
    mesh->faces.push_back({a, ab, ca});
    mesh->faces.push_back({ca, bc, c});
    mesh->faces.push_back({ab, bc, ca});
    return;
  }
  // Of the quadrangle that is left the shorter diagonal.
  const auto& at = mesh->vertices;
  if ((at[ab] - at[c]).squaredNorm() < (at[a] - at[bc]).squaredNorm()) {
    mesh->faces.push_back({a, ab, c});
    mesh->faces.push_back({ab, bc, c});
  } else {
    mesh->faces.push_back({a, ab, bc});
    mesh->faces.push_back({a, bc, c});
  }
}

// Whether an edge was halved.
bool HalveLongEdges(double longest, GrowingMesh* mesh) {
  std::vector<Corners> middles(mesh->faces.size(), {-1, -1, -1});
  bool has_split = false;
  ForEachEdge(FacesOf(*mesh), static_cast<int>(mesh->vertices.size()),
              [&](int low, int high, const HalfEdgeGroup& group) {
                if ((mesh->vertices[low] - mesh->vertices[high]).norm() <= longest) return;
                const int middle = mesh->AddBetween(low, high);
                for (size_t i = 0; i < group.size(); ++i)
                  middles[group[i] / 3][group[i] % 3] = middle;
                has_split = true;
              });
  for (size_t f = 0; f < middles.size(); ++f) CutFace(static_cast<int>(f), middles[f], mesh);
  return has_split;
}

}  // namespace

absl::StatusOr<ControlMesh> SplitLongEdges(ControlMesh mesh, double longest,
                                           const RunContext& context) {
  GrowingMesh grown = Growing(mesh);
  mesh = ControlMesh();
  const auto check = [&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (static_cast<int64_t>(grown.faces.size()) < kMostFaces) return absl::OkStatus();
    return absl::ResourceExhaustedError(
        absl::StrCat("the mesh has more than ", kMostFaces, " faces when it is cut finely enough"));
  };
  for (bool has_split = true; has_split;) {
    RILIEVO_ASSIGN_OR_RETURN(has_split, SplitWideFans(&grown));
    RILIEVO_RETURN_IF_ERROR(check());
  }
  while (HalveLongEdges(longest, &grown)) RILIEVO_RETURN_IF_ERROR(check());
  return Grown(grown);
}

}  // namespace rilievo
