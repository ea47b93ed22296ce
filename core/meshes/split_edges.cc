#include "core/meshes/split_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>
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

// The edges of a mesh, by half-edge, and what is known of them.
struct Edges {
  std::vector<int> of_half_edge;
  std::vector<std::array<int, 2>> ends, faces;  // of a border edge the second face is -1
  std::vector<double> length;
};

Edges EdgesOf(const GrowingMesh& mesh) {
  Edges edges;
  edges.of_half_edge.resize(3 * mesh.faces.size());
  ForEachEdge(FacesOf(mesh), static_cast<int>(mesh.vertices.size()),
              [&](int low, int high, const HalfEdgeGroup& group) {
                for (size_t i = 0; i < group.size(); ++i) {
                  edges.of_half_edge[group[i]] = static_cast<int>(edges.ends.size());
                }
                edges.ends.push_back({low, high});
                edges.faces.push_back({static_cast<int>(group[0] / 3),
                                       group.size() > 1 ? static_cast<int>(group[1] / 3) : -1});
                edges.length.push_back((mesh.vertices[low] - mesh.vertices[high]).norm());
              });
  return edges;
}

// The corner whose half-edge is the longest; of equal ones that of the first edge.
int LongestCorner(const Edges& edges, int face) {
  int longest = 0;
  for (int k = 1; k < 3; ++k) {
    const int edge = edges.of_half_edge[3 * face + k],
              best = edges.of_half_edge[3 * face + longest];
    const double more = edges.length[edge] - edges.length[best];
    if (more > 0 || (more == 0 && edge < best)) longest = k;
  }
  return longest;
}

// Those given, by edge, and the longest edges of the faces at them, in turn: a face with a marked
// edge has its longest marked too.
std::vector<uint8_t> WithLongestBeside(const Edges& edges, std::vector<uint8_t> marked) {
  std::vector<int> waiting;
  for (size_t edge = 0; edge < marked.size(); ++edge) {
    if (marked[edge] != 0) waiting.push_back(static_cast<int>(edge));
  }
  while (!waiting.empty()) {
    const auto beside = edges.faces[waiting.back()];
    waiting.pop_back();
    for (const int face : beside) {
      if (face < 0) continue;
      const int edge = edges.of_half_edge[3 * face + LongestCorner(edges, face)];
      if (marked[edge] != 0) continue;
      marked[edge] = 1;
      waiting.push_back(edge);
    }
  }
  return marked;
}

// Halves a face at the middle of its longest edge, and each half where its own other edge has a
// middle. `middle`: by corner, of its half-edge; -1: none.
void CutFace(int face, int longest, const Corners& middle, GrowingMesh* mesh) {
  if (middle[longest] < 0) return;
  const int next = kNextCorner[longest], previous = kPreviousCorner[longest];
  const Corners old = mesh->faces[face];
  const int a = old[longest], b = old[next], c = old[previous];
  const int ab = middle[longest], bc = middle[next], ca = middle[previous];
  mesh->faces[face] = {a, ab, ca >= 0 ? ca : c};
  if (ca >= 0) mesh->faces.push_back({ab, c, ca});
  mesh->faces.push_back({ab, b, bc >= 0 ? bc : c});
  if (bc >= 0) mesh->faces.push_back({ab, bc, c});
}

// The middle of each marked edge, else -1. The mesh has no gaps before and after.
std::vector<int> HalveMarked(const Edges& edges, const std::vector<uint8_t>& marked,
                             GrowingMesh* mesh) {
  const auto faces = static_cast<int>(mesh->faces.size());
  std::vector<int> middle(marked.size(), -1);
  for (size_t edge = 0; edge < marked.size(); ++edge) {
    if (marked[edge] == 0) continue;
    middle[edge] = mesh->AddBetween(edges.ends[edge][0], edges.ends[edge][1]);
  }
  for (int face = 0; face < faces; ++face) {
    Corners middles;
    for (int k = 0; k < 3; ++k) middles[k] = middle[edges.of_half_edge[3 * face + k]];
    CutFace(face, LongestCorner(edges, face), middles, mesh);
  }
  return middle;
}

// Whether an edge was halved: of each face that has a longer one than `longest` its longest.
bool HalveLongEdges(double longest, GrowingMesh* mesh) {
  const Edges edges = EdgesOf(*mesh);
  std::vector<uint8_t> marked(edges.ends.size(), 0);
  bool has_long = false;
  for (int face = 0; face < static_cast<int>(mesh->faces.size()); ++face) {
    const int edge = edges.of_half_edge[3 * face + LongestCorner(edges, face)];
    if (edges.length[edge] <= longest) continue;
    marked[edge] = 1;
    has_long = true;
  }
  if (has_long) HalveMarked(edges, WithLongestBeside(edges, std::move(marked)), mesh);
  return has_long;
}

// Halved once a needle is three, each of half its length.
const double kNeedleGrowth = std::log2(3.0);

// So long that the triangles which are longer than `longest` become about `most`, were all needles.
double LongestOfPieces(const ControlMesh& mesh, double longest, int64_t most) {
  double sum = 0;
  for (const auto face : mesh.faces.colwise()) {
    double length = 0;
    for (int k = 0; k < 3; ++k) {
      const auto edge = mesh.vertices.col(face[kNextCorner[k]]) - mesh.vertices.col(face[k]);
      length = std::max(length, edge.norm());
    }
    if (length > longest) sum += std::pow(length, kNeedleGrowth);
  }
  return std::max(longest, std::pow(sum / static_cast<double>(most), 1 / kNeedleGrowth));
}

}  // namespace

absl::StatusOr<ControlMesh> SplitLongEdges(ControlMesh mesh, double longest, int64_t most_pieces,
                                           const RunContext& context) {
  longest = LongestOfPieces(mesh, longest, most_pieces);
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

ControlMesh HalveEdges(const ControlMesh& mesh, const std::vector<std::array<int, 2>>& edges) {
  GrowingMesh grown = Growing(mesh);
  const Edges all = EdgesOf(grown);
  std::map<std::pair<int, int>, size_t> numbers;
  for (size_t e = 0; e < all.ends.size(); ++e) numbers[{all.ends[e][0], all.ends[e][1]}] = e;
  const auto number = [&](int a, int b) { return numbers.find(std::minmax(a, b)); };
  std::vector<uint8_t> marked(all.ends.size(), 0);
  for (const auto& [a, b] : edges) {
    const auto found = number(a, b);
    if (found != numbers.end()) marked[found->second] = 1;
  }
  const std::vector<int> middle =
      HalveMarked(all, WithLongestBeside(all, std::move(marked)), &grown);
  ControlMesh halved = Grown(grown);
  halved.corners = mesh.corners;
  for (const Crease& crease : mesh.creases) {
    const auto found = number(crease.a, crease.b);
    const int m = found == numbers.end() ? -1 : middle[found->second];
    if (m < 0) {
      halved.creases.push_back(crease);
      continue;
    }
    halved.creases.push_back({crease.a, m, crease.sharpness});
    halved.creases.push_back({crease.b, m, crease.sharpness});
  }
  std::sort(halved.creases.begin(), halved.creases.end(), [](const Crease& x, const Crease& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
  });
  return halved;
}

}  // namespace rilievo
