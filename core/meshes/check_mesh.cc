#include "core/meshes/check_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/mesh_topology.h"
#include "core/scan/clean/check_scan.h"

namespace rilievo {
namespace {

// By point: the first of those at its place that a triangle names, or -1.
absl::StatusOr<std::vector<int>> FirstAtPlace(const PointCloud& mesh, const RunContext& context) {
  std::vector<uint8_t> used(static_cast<size_t>(mesh.points.cols()), 0);
  for (const int corner : mesh.triangles.reshaped()) used[corner] = 1;
  std::vector<int> order;
  for (int i = 0; i < mesh.points.cols(); ++i) {
    if (used[i] != 0 && mesh.points.col(i).allFinite()) order.push_back(i);
  }
  const auto place = [&](int i) {
    return std::tuple(mesh.points(0, i), mesh.points(1, i), mesh.points(2, i));
  };
  const auto before = [&](int a, int b) {
    return std::tuple_cat(place(a), std::tuple(a)) < std::tuple_cat(place(b), std::tuple(b));
  };
  RILIEVO_RETURN_IF_ERROR(ParallelSort(before, context, &order));
  std::vector<int> first(used.size(), -1);
  for (size_t i = 0; i < order.size(); ++i) {
    const bool is_same = i > 0 && place(order[i]) == place(order[i - 1]);
    first[order[i]] = is_same ? first[order[i - 1]] : order[i];
  }
  return first;
}

// The triangles of three different places, each set of three once.
absl::StatusOr<Eigen::Matrix3Xi> DistinctTriangles(const Eigen::Matrix3Xi& given,
                                                   const std::vector<int>& first_at_place,
                                                   const RunContext& context) {
  struct Entry {
    std::array<int, 3> corners;  // ascending
    int triangle;
    bool operator<(const Entry& other) const {
      return std::tie(corners, triangle) < std::tie(other.corners, other.triangle);
    }
  };
  std::vector<Entry> entries;
  for (int t = 0; t < given.cols(); ++t) {
    Entry entry{{}, t};
    for (int k = 0; k < 3; ++k) entry.corners[k] = first_at_place[given(k, t)];
    std::sort(entry.corners.begin(), entry.corners.end());
    const auto& [a, b, c] = entry.corners;
    if (a >= 0 && a != b && b != c) entries.push_back(entry);
  }
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<Entry>(), context, &entries));
  const auto same = [](const Entry& x, const Entry& y) { return x.corners == y.corners; };
  entries.erase(std::unique(entries.begin(), entries.end(), same), entries.end());
  std::vector<int> kept(entries.size());
  std::transform(entries.begin(), entries.end(), kept.begin(),
                 [](const Entry& entry) { return entry.triangle; });
  std::sort(kept.begin(), kept.end());
  Eigen::Matrix3Xi distinct(3, static_cast<int64_t>(kept.size()));
  for (size_t i = 0; i < kept.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      distinct(k, static_cast<int64_t>(i)) = first_at_place[given(k, kept[i])];
    }
  }
  return distinct;
}

// Triangles that hang together across edges. Half-edges as in half_edges.h.
struct LinkedTriangles {
  Eigen::Matrix3Xd vertices;  // unit frame
  Eigen::Matrix3Xi faces;
  std::vector<uint32_t> partner;  // by half-edge: the one across, or kNoHalfEdge
  int64_t opened = 0, flipped = 0;

  void Link(uint32_t a, uint32_t b) {
    partner[a] = b;
    partner[b] = a;
  }
  void Open(uint32_t h) {
    partner[partner[h]] = kNoHalfEdge;
    partner[h] = kNoHalfEdge;
  }
  double DoubleArea(int face) const {
    const Eigen::Vector3d origin = vertices.col(faces(0, face));
    return (vertices.col(faces(1, face)) - origin)
        .cross(vertices.col(faces(2, face)) - origin)
        .norm();
  }
};

void LinkPairs(LinkedTriangles* mesh) {
  mesh->partner.assign(static_cast<size_t>(3 * mesh->faces.cols()), kNoHalfEdge);
  ForEachEdge(mesh->faces, static_cast<int>(mesh->vertices.cols()),
              [&](int, int, const HalfEdgeGroup& group) {
                if (group.size() == 2) mesh->Link(group[0], group[1]);
              });
}

// The other way round: corner 0 stays, so the half-edge of corner k becomes that of corner 2 - k.
void TurnOver(const std::vector<uint8_t>& turned, LinkedTriangles* mesh) {
  const auto renamed = [&](uint32_t h) {
    return h == kNoHalfEdge || turned[h / 3] == 0 ? h : h / 3 * 3 + 2 - h % 3;
  };
  for (uint32_t& h : mesh->partner) h = renamed(h);
  for (size_t face = 0; face < turned.size(); ++face) {
    if (turned[face] == 0) continue;
    std::swap(mesh->faces(1, face), mesh->faces(2, face));
    std::swap(mesh->partner[3 * face], mesh->partner[3 * face + 2]);
    ++mesh->flipped;
  }
}

// What is known of a piece while its triangles are turned alike.
struct Piece {
  std::vector<int> faces;
  double double_area = 0, squared_edges = 0;
  double balance = 0;         // double area of those that stay less that of those turned
  double sixfold_volume = 0;  // as turned
  bool is_closed = true, is_mixed = false;

  // Collinear to the last digits.
  bool is_flat() const { return double_area < 1e-13 * squared_edges; }
  // A closed piece whose triangles do not agree faces outwards; else the side of most area is
  // right: a void faces inwards.
  bool must_turn() const { return is_closed && is_mixed ? sixfold_volume < 0 : balance < 0; }
};

void AddFace(int face, bool is_turned, const LinkedTriangles& mesh, Piece* piece) {
  const auto corner = [&](int k) { return mesh.vertices.col(mesh.faces(k, face)); };
  const double area = mesh.DoubleArea(face), sign = is_turned ? -1 : 1;
  piece->double_area += area;
  piece->balance += sign * area;
  piece->is_mixed = piece->is_mixed || is_turned;
  piece->sixfold_volume += sign * corner(0).dot(corner(1).cross(corner(2)));
  for (int k = 0; k < 3; ++k) {
    piece->squared_edges += (corner(k) - corner(kNextCorner[k])).squaredNorm();
    piece->is_closed = piece->is_closed && mesh.partner[3 * face + k] != kNoHalfEdge;
  }
}

// Takes faces out whose neighbours go too.
void RemoveFaces(const std::vector<uint8_t>& removed, LinkedTriangles* mesh) {
  std::vector<uint32_t> renamed(removed.size());
  uint32_t kept = 0;
  for (size_t face = 0; face < removed.size(); ++face) {
    if (removed[face] == 0) renamed[face] = kept++;
  }
  for (size_t face = 0; face < removed.size(); ++face) {
    if (removed[face] != 0) continue;
    mesh->faces.col(renamed[face]) = Eigen::Vector3i(mesh->faces.col(static_cast<int64_t>(face)));
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t across = mesh->partner[3 * face + k];
      mesh->partner[3 * renamed[face] + k] =
          across == kNoHalfEdge ? across : 3 * renamed[across / 3] + across % 3;
    }
  }
  mesh->faces.conservativeResize(3, kept);
  mesh->partner.resize(size_t{3} * kept);
}

// All triangles of a piece face the same side; where a piece meets itself with the other side it is
// opened. Pieces without area are taken out.
absl::Status OrientPieces(const RunContext& context, LinkedTriangles* mesh) {
  const auto count = static_cast<size_t>(mesh->faces.cols());
  constexpr uint8_t kUnseen = 2;
  std::vector<uint8_t> turned(count, kUnseen), removed(count, 0);
  Piece piece;
  for (size_t seed = 0; seed < count; ++seed) {
    if (turned[seed] != kUnseen) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<int> room = std::move(piece.faces);
    room.assign(1, static_cast<int>(seed));
    piece = Piece();
    piece.faces = std::move(room);
    turned[seed] = 0;
    for (size_t next = 0; next < piece.faces.size(); ++next) {
      const int face = piece.faces[next];
      AddFace(face, turned[face] != 0, *mesh, &piece);
      for (int k = 0; k < 3; ++k) {
        const auto h = static_cast<uint32_t>(3 * face + k);
        const uint32_t across = mesh->partner[h];
        if (across == kNoHalfEdge) continue;
        const bool same_way = Origin(mesh->faces, h) == Origin(mesh->faces, across);
        const auto wanted = static_cast<uint8_t>(turned[face] ^ (same_way ? 1 : 0));
        uint8_t& other = turned[across / 3];
        if (other == kUnseen) {
          other = wanted;
          piece.faces.push_back(static_cast<int>(across / 3));
        } else if (other != wanted) {
          mesh->Open(h);
          ++mesh->opened;
          piece.is_closed = false;
        }
      }
    }
    for (const int face : piece.faces) {
      if (piece.must_turn()) turned[face] ^= 1;
      removed[face] = piece.is_flat();
    }
  }
  TurnOver(turned, mesh);
  RemoveFaces(removed, mesh);
  return absl::OkStatus();
}

// A triangle at an edge, seen along it from its low to its high vertex.
struct Leaf {
  double angle;   // of its third corner
  bool backward;  // runs from high to low: then its solid lies at larger angles, else at smaller
  uint32_t half_edge;
  bool operator<(const Leaf& other) const {
    return std::tie(angle, backward, half_edge) <
           std::tie(other.angle, other.backward, other.half_edge);
  }
};

std::vector<Leaf> LeavesAround(int low, int high, const HalfEdgeGroup& group,
                               const LinkedTriangles& mesh) {
  const Eigen::Vector3d origin = mesh.vertices.col(low);
  const Eigen::Vector3d axis = (mesh.vertices.col(high) - origin).normalized();
  const Eigen::Vector3d right = axis.unitOrthogonal(), up = axis.cross(right);
  std::vector<Leaf> leaves(group.size());
  for (size_t i = 0; i < group.size(); ++i) {
    const uint32_t h = group[i];
    const Eigen::Vector3d arm = mesh.vertices.col(Origin(mesh.faces, PreviousHalfEdge(h))) - origin;
    leaves[i] = {std::atan2(arm.dot(up), arm.dot(right)), Origin(mesh.faces, h) != low, h};
  }
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

// Where more than two triangles meet, the two around each wedge of a solid are linked, inner wedges
// first, as brackets are matched.
void LinkWedges(LinkedTriangles* mesh) {
  ForEachEdge(mesh->faces, static_cast<int>(mesh->vertices.cols()),
              [&](int low, int high, const HalfEdgeGroup& group) {
                if (group.size() < 3) return;
                ++mesh->opened;
                const std::vector<Leaf> leaves = LeavesAround(low, high, group, *mesh);
                std::vector<uint32_t> open;  // backward ones that wait for theirs
                for (size_t i = 0; i < 2 * leaves.size(); ++i) {  // twice: the angle is cyclic
                  const Leaf& leaf = leaves[i % leaves.size()];
                  if (mesh->partner[leaf.half_edge] != kNoHalfEdge) continue;
                  if (!leaf.backward && !open.empty()) {
                    mesh->Link(open.back(), leaf.half_edge);
                    open.pop_back();
                  } else if (leaf.backward && i < leaves.size()) {
                    open.push_back(leaf.half_edge);
                  }
                }
              });
}

// Sets of corners that are one vertex.
class CornerSets {
 public:
  explicit CornerSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  uint32_t Find(uint32_t corner) {
    while (parent_[corner] != corner) {
      corner = parent_[corner] = parent_[parent_[corner]];
    }
    return corner;
  }
  // The smaller one stands for both, so that the order of the corners names the sets.
  void Unite(uint32_t a, uint32_t b) {
    a = Find(a), b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> parent_;
};

// Corners are one vertex where triangles hang together around them, so fans that only touch get
// vertices of their own. Returns by vertex the column of `mesh->vertices` that it was.
std::vector<int> SeparateFans(LinkedTriangles* mesh) {
  CornerSets sets(mesh->partner.size());
  for (uint32_t h = 0; h < mesh->partner.size(); ++h) {
    const uint32_t across = mesh->partner[h];
    if (across == kNoHalfEdge) continue;
    sets.Unite(h, NextHalfEdge(across));
    sets.Unite(NextHalfEdge(h), across);
  }
  std::vector<int> number(mesh->partner.size()), place;
  for (uint32_t h = 0; h < mesh->partner.size(); ++h) {
    const uint32_t set = sets.Find(h);
    if (set == h) {
      number[h] = static_cast<int>(place.size());
      place.push_back(Origin(mesh->faces, h));
    }
    mesh->faces.data()[h] = number[set];
  }
  mesh->vertices = Eigen::Matrix3Xd(mesh->vertices(Eigen::all, place));
  return place;
}

// A half-edge from `a` to `b`, and its triangle with it, become one from `a` to `middle` and a new
// one, the first of face `added`, from there to `b`.
uint32_t SplitHalfEdge(uint32_t h, int middle, int added, LinkedTriangles* mesh) {
  const uint32_t next = NextHalfEdge(h), first = 3 * static_cast<uint32_t>(added);
  const uint32_t beyond = mesh->partner[next];
  mesh->faces.col(added) << middle, Origin(mesh->faces, next),
      Origin(mesh->faces, PreviousHalfEdge(h));
  mesh->faces.data()[next] = middle;
  if (beyond != kNoHalfEdge) mesh->Link(beyond, first + 1);
  mesh->Link(next, first + 2);
  return first;
}

// One half-edge of each edge but the first between the same two vertices.
std::vector<uint32_t> RepeatedEdges(const LinkedTriangles& mesh) {
  std::vector<uint32_t> repeated;
  ForEachEdge(mesh.faces, static_cast<int>(mesh.vertices.cols()),
              [&](int, int, const HalfEdgeGroup& group) {
                const uint32_t kept = mesh.partner[group[0]];
                for (size_t i = 1; i < group.size(); ++i) {
                  const bool is_second = mesh.partner[group[i]] < group[i];
                  if (group[i] != kept && !is_second) repeated.push_back(group[i]);
                }
              });
  return repeated;
}

// A manifold has one edge between two vertices: others get a vertex in their middle. A round splits
// a triangle once; seldom a second is needed.
void SplitRepeatedEdges(LinkedTriangles* mesh, std::vector<int>* place) {
  for (;;) {
    const std::vector<uint32_t> repeated = RepeatedEdges(*mesh);
    if (repeated.empty()) return;
    auto faces = static_cast<int>(mesh->faces.cols()), vertices = static_cast<int>(place->size());
    const auto room = static_cast<int64_t>(repeated.size());
    std::vector<uint8_t> touched(static_cast<size_t>(faces + 2 * room), 1);  // the new ones wait
    std::fill_n(touched.begin(), faces, 0);
    mesh->faces.conservativeResize(3, faces + 2 * room);
    mesh->vertices.conservativeResize(3, vertices + room);
    mesh->partner.resize(static_cast<size_t>(3 * (faces + 2 * room)), kNoHalfEdge);
    for (const uint32_t h : repeated) {
      const uint32_t across = mesh->partner[h];
      if (touched[h / 3] != 0 || (across != kNoHalfEdge && touched[across / 3] != 0)) continue;
      const int a = Origin(mesh->faces, h), b = Origin(mesh->faces, NextHalfEdge(h));
      mesh->vertices.col(vertices) = (mesh->vertices.col(a) + mesh->vertices.col(b)) / 2;
      place->push_back((*place)[a]);
      touched[h / 3] = 1;
      const uint32_t behind = SplitHalfEdge(h, vertices, faces++, mesh);
      if (across != kNoHalfEdge) {
        touched[across / 3] = 1;
        const uint32_t behind_across = SplitHalfEdge(across, vertices, faces++, mesh);
        mesh->Link(h, behind_across);
        mesh->Link(across, behind);
      }
      ++vertices;
    }
    mesh->faces.conservativeResize(3, faces);
    mesh->vertices.conservativeResize(3, vertices);
    mesh->partner.resize(static_cast<size_t>(3 * faces));
  }
}

}  // namespace

absl::Status CheckTriangles(const PointCloud& mesh) {
  if (mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("triangles: there are none; a mesh needs at least one");
  }
  const auto points = static_cast<int>(mesh.points.cols());
  for (int t = 0; t < mesh.triangles.cols(); ++t) {
    for (const int corner : mesh.triangles.col(t)) {
      if (corner >= 0 && corner < points) continue;
      return absl::InvalidArgumentError(absl::StrCat("triangles: triangle ", t, " names vertex ",
                                                     corner, "; there are the vertices 0 to ",
                                                     points - 1));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<CheckedMesh> CheckMesh(const PointCloud& mesh, const RunContext& context) {
  context.Report(Stage::kCheck, 0);
  RILIEVO_RETURN_IF_ERROR(CheckTriangles(mesh));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> first, FirstAtPlace(mesh, context));
  CheckedMesh checked;
  checked.figures.triangles = mesh.triangles.cols();
  LinkedTriangles linked;
  RILIEVO_ASSIGN_OR_RETURN(linked.faces, DistinctTriangles(mesh.triangles, first, context));
  std::vector<int> places;  // the points at them
  for (int i = 0; i < static_cast<int>(first.size()); ++i) {
    checked.figures.welded_vertices += first[i] >= 0 && first[i] != i;
    if (first[i] == i) places.push_back(i);
  }
  if (linked.faces.cols() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("triangles: none of the ", mesh.triangles.cols(),
                     " has three finite corners at three different places"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const SpatialFrame frame, BoundingFrame(mesh.points, places));
  checked.frame = Rounded(frame);
  context.Report(Stage::kCheck, 0.3);
  std::vector<int> number(first.size(), -1);
  linked.vertices.resize(3, static_cast<int64_t>(places.size()));
  for (size_t i = 0; i < places.size(); ++i) {
    number[places[i]] = static_cast<int>(i);
    linked.vertices.col(static_cast<int64_t>(i)) =
        checked.frame.UnitFromScan(mesh.points.col(places[i]));
  }
  for (int& corner : linked.faces.reshaped()) corner = number[corner];
  LinkPairs(&linked);
  RILIEVO_RETURN_IF_ERROR(OrientPieces(context, &linked));
  checked.figures.triangles_used = linked.faces.cols();
  checked.figures.dropped = mesh.triangles.cols() - linked.faces.cols();
  if (linked.faces.cols() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("triangles: none of the ", mesh.triangles.cols(), " has an area"));
  }
  context.Report(Stage::kCheck, 0.6);
  LinkWedges(&linked);
  checked.source_vertex = SeparateFans(&linked);
  SplitRepeatedEdges(&linked, &checked.source_vertex);
  for (int& place : checked.source_vertex) place = places[place];
  checked.figures.opened_edges = linked.opened;
  checked.figures.flipped = linked.flipped;
  checked.vertices = std::move(linked.vertices);
  checked.triangles = std::move(linked.faces);
  context.Report(Stage::kCheck, 1);
  return checked;
}

}  // namespace rilievo
