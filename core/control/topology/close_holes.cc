#include "core/control/topology/close_holes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"
#include "core/loop/crease_topology.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kMostTurn = std::numbers::pi;
// Edges of a rim for which the least area is searched for, in time with their cube.
constexpr int kMostSearched = 1000;
// Squared lengths of chords count so much beside the area: in a plane all triangles together have
// the same.
constexpr double kShortChords = 0.01;
// New edges are halved above this many times the length wanted: halves are nearer to it.
constexpr double kLongEdge = std::numbers::sqrt2;
constexpr double kShareOfFaces = 0.25;  // new ones, of those there were
constexpr int kFillShapeRounds = 6, kEvenRounds = 5;
constexpr double kFlatFillDegrees = 40;

using FillTriangles = std::vector<std::array<int, 3>>;
using Edges = std::set<std::pair<int, int>>;  // lower vertex first

std::pair<int, int> EdgeOf(int a, int b) { return std::minmax(a, b); }

double RimLength(const ControlMesh& mesh, const std::vector<int>& rim) {
  double length = 0;
  for (size_t i = 0; i < rim.size(); ++i) {
    length += (mesh.vertices.col(rim[(i + 1) % rim.size()]) - mesh.vertices.col(rim[i])).norm();
  }
  return length;
}

// By vertex, the sum of the angles of its faces.
std::vector<double> AngleSums(const ControlMesh& mesh) {
  std::vector<double> sums(static_cast<size_t>(mesh.vertices.cols()), 0);
  for (const auto face : mesh.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d at = mesh.vertices.col(face[k]);
      const Vector3d a = mesh.vertices.col(face[kNextCorner[k]]) - at;
      const Vector3d b = mesh.vertices.col(face[kPreviousCorner[k]]) - at;
      sums[face[k]] += std::atan2(a.cross(b).norm(), a.dot(b));
    }
  }
  return sums;
}

double TurnOf(const std::vector<int>& rim, const std::vector<double>& angles) {
  double turn = 0;
  for (const int v : rim) turn += std::numbers::pi - angles[v];
  return turn;
}

// The triangles of least area over a closed polygon, none of whose chords is one of `edges`; none
// where there are no such triangles.
class LeastArea {
 public:
  LeastArea(const Eigen::Matrix3Xd& vertices, const std::vector<int>& polygon, const Edges& edges)
      : vertices_(vertices), polygon_(polygon), count_(static_cast<int>(polygon.size())) {
    area_.assign(static_cast<size_t>(count_) * count_, 0);
    middle_.assign(area_.size(), -1);
    for (int span = 2; span < count_; ++span) {
      for (int first = 0; first + span < count_; ++first) Search(first, first + span, edges);
    }
  }

  void AddTo(FillTriangles* triangles) const {
    if (!std::isfinite(area_[At(0, count_ - 1)])) return;
    std::vector<std::pair<int, int>> waiting = {{0, count_ - 1}};
    while (!waiting.empty()) {
      const auto [first, last] = waiting.back();
      waiting.pop_back();
      if (last - first < 2) continue;
      const int middle = middle_[At(first, last)];
      triangles->push_back({polygon_[first], polygon_[middle], polygon_[last]});
      waiting.emplace_back(first, middle);
      waiting.emplace_back(middle, last);
    }
  }

 private:
  size_t At(int first, int last) const { return static_cast<size_t>(first) * count_ + last; }

  void Search(int first, int last, const Edges& edges) {
    double least = std::numeric_limits<double>::infinity();
    const bool is_rim = first == 0 && last == count_ - 1;
    if (is_rim || !edges.contains(EdgeOf(polygon_[first], polygon_[last]))) {
      const Vector3d from = vertices_.col(polygon_[first]);
      const Vector3d chord = vertices_.col(polygon_[last]) - from;
      for (int middle = first + 1; middle < last; ++middle) {
        const double sides = area_[At(first, middle)] + area_[At(middle, last)];
        if (sides >= least) continue;
        const double area = sides + chord.cross(vertices_.col(polygon_[middle]) - from).norm() / 2;
        if (area >= least) continue;
        least = area;
        middle_[At(first, last)] = middle;
      }
    }
    const Vector3d chord = vertices_.col(polygon_[last]) - vertices_.col(polygon_[first]);
    area_[At(first, last)] = least + kShortChords * chord.squaredNorm();
  }

  const Eigen::Matrix3Xd& vertices_;
  const std::vector<int>& polygon_;
  const int count_;
  std::vector<double> area_;  // of what lies between two vertices, by At()
  std::vector<int> middle_;   // the third vertex of the triangle at their chord
};

// FillTriangles around a new vertex amid the polygon.
void AddFan(const std::vector<int>& polygon, ControlMesh* mesh, FillTriangles* triangles) {
  const auto middle = static_cast<int>(mesh->vertices.cols());
  const Vector3d mean = mesh->vertices(Eigen::all, polygon).rowwise().mean();
  mesh->vertices.conservativeResize(3, middle + 1);
  mesh->vertices.col(middle) = mean;
  for (size_t i = 0; i < polygon.size(); ++i) {
    triangles->push_back({polygon[i], polygon[(i + 1) % polygon.size()], middle});
  }
}

void AppendFaces(const FillTriangles& triangles, ControlMesh* mesh) {
  const Eigen::Index before = mesh->faces.cols();
  mesh->faces.conservativeResize(3, before + static_cast<Eigen::Index>(triangles.size()));
  for (size_t i = 0; i < triangles.size(); ++i) {
    mesh->faces.col(before + static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::Vector3i>(triangles[i].data());
  }
}

// Halves edges between faces from `first_new` on that are longer than `longest`, the longest first
// and each face once; false when there is none.
absl::StatusOr<bool> HalveLongEdges(Eigen::Index first_new, double longest, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  std::vector<std::pair<double, int>> edges;  // negative length first, so that they sort well
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (topology.edge_faces.col(e).minCoeff() < first_new) continue;
    const double length = (mesh->vertices.col(topology.edge_vertices(0, e)) -
                           mesh->vertices.col(topology.edge_vertices(1, e)))
                              .norm();
    if (length > longest) edges.emplace_back(-length, e);
  }
  if (edges.empty()) return false;
  std::sort(edges.begin(), edges.end());
  std::vector<uint8_t> is_cut(static_cast<size_t>(mesh->faces.cols()), 0);
  FillTriangles halves;
  std::vector<Vector3d> middles;
  for (const auto& [length, edge] : edges) {
    const auto faces = topology.edge_faces.col(edge);
    if (is_cut[faces[0]] != 0 || is_cut[faces[1]] != 0) continue;
    const auto middle = static_cast<int>(mesh->vertices.cols()) + static_cast<int>(middles.size());
    middles.push_back((mesh->vertices.col(topology.edge_vertices(0, edge)) +
                       mesh->vertices.col(topology.edge_vertices(1, edge))) /
                      2);
    for (const int face : faces) {
      is_cut[face] = 1;
      const int corner = CornerOfEdge(topology, face, edge), next = kNextCorner[corner];
      halves.push_back({middle, mesh->faces(next, face), mesh->faces(kNextCorner[next], face)});
      mesh->faces(next, face) = middle;
    }
  }
  const Eigen::Index before = mesh->vertices.cols();
  mesh->vertices.conservativeResize(3, before + static_cast<Eigen::Index>(middles.size()));
  for (size_t i = 0; i < middles.size(); ++i) {
    mesh->vertices.col(before + static_cast<Eigen::Index>(i)) = middles[i];
  }
  AppendFaces(halves, mesh);
  return true;
}

// Brings vertices from `first_new` on amid their neighbours, in turn.
absl::Status EvenOut(int first_new, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  const VertexRings rings = BuildVertexRings(topology);
  for (int round = 0; round < kEvenRounds; ++round) {
    for (int v = first_new; v < topology.vertex_count; ++v) {
      Vector3d sum = Vector3d::Zero();
      for (int k = rings.neighbor_begin[v]; k < rings.neighbor_begin[v + 1]; ++k) {
        sum += mesh->vertices.col(rings.neighbors[k]);
      }
      mesh->vertices.col(v) = sum / (rings.neighbor_begin[v + 1] - rings.neighbor_begin[v]);
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ControlMesh> CloseHoles(ControlMesh mesh, double longest_rim,
                                       const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  const std::vector<double> angles = AngleSums(mesh);
  const Eigen::Index face_count = mesh.faces.cols();
  std::vector<Crease> creases = mesh.creases;  // rims are among them until all is done
  Edges edges;
  for (const auto edge : topology.edge_vertices.colwise()) edges.emplace(edge[0], edge[1]);
  FillTriangles triangles;
  double rims = 0, area = 0;
  int64_t rim_edges = 0;
  for (std::vector<int>& rim : BoundaryLoops(topology)) {
    const double length = RimLength(mesh, rim);
    if (length >= longest_rim || TurnOf(rim, angles) > kMostTurn) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::reverse(rim.begin(), rim.end());  // the new faces lie on its other side
    const size_t first = triangles.size();
    if (rim.size() <= kMostSearched) {
      LeastArea(mesh.vertices, rim, edges).AddTo(&triangles);
    }
    if (triangles.size() == first) AddFan(rim, &mesh, &triangles);
    for (size_t i = first; i < triangles.size(); ++i) {
      area += FaceCross(mesh.vertices, Eigen::Vector3i::Map(triangles[i].data()), 0).norm() / 2;
      for (int k = 0; k < 3; ++k) {
        edges.insert(EdgeOf(triangles[i][k], triangles[i][kNextCorner[k]]));
      }
    }
    for (size_t i = 0; i < rim.size(); ++i) {
      const auto [a, b] = EdgeOf(rim[i], rim[(i + 1) % rim.size()]);
      mesh.creases.push_back({a, b});
    }
    rims += length;
    rim_edges += static_cast<int64_t>(rim.size());
  }
  if (triangles.empty()) return mesh;
  AppendFaces(triangles, &mesh);
  SortTags(&mesh.creases, &mesh.corners);
  // Equilateral faces of that area come to the share of faces.
  const double most_faces = kShareOfFaces * static_cast<double>(face_count);
  const double wanted = std::max(rims / static_cast<double>(rim_edges),
                                 std::sqrt(4 / std::numbers::sqrt3 * area / most_faces));
  // Beside a rim edge that is much longer than the others there is always one more to halve.
  const auto enough = mesh.faces.cols() + static_cast<Eigen::Index>(2 * most_faces);
  for (bool halved = true; halved && mesh.faces.cols() < enough;) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(halved, HalveLongEdges(face_count, kLongEdge * wanted, &mesh));
    ImproveValence(&mesh, kFlatFillDegrees);
  }
  for (int round = 0; round < kFillShapeRounds; ++round) {
    RILIEVO_RETURN_IF_ERROR(EvenOut(topology.vertex_count, &mesh));
    ImproveValence(&mesh, kFlatFillDegrees);
  }
  mesh.creases = std::move(creases);
  return mesh;
}

}  // namespace rilievo
