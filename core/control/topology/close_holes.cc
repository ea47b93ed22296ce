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
#include "core/control/topology/grow_faces.h"
#include "core/control/topology/settings.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kMostTurn = std::numbers::pi;

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
    area_[At(first, last)] = least + kGrowFaces.short_chords * chord.squaredNorm();
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

}  // namespace

absl::StatusOr<ControlMesh> CloseHoles(ControlMesh mesh, double longest_rim,
                                       const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  const std::vector<double> angles = AngleSums(mesh);
  Edges edges;
  for (const auto edge : topology.edge_vertices.colwise()) edges.emplace(edge[0], edge[1]);
  GrownFaces grown;
  std::vector<std::array<int, 3>>& triangles = grown.triangles;
  for (std::vector<int>& rim : BoundaryLoops(topology)) {
    if (RimLength(mesh, rim) >= longest_rim || TurnOf(rim, angles) > kMostTurn) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::reverse(rim.begin(), rim.end());  // the new faces lie on its other side
    const size_t first = triangles.size();
    if (rim.size() <= kCloseHoles.most_searched) {
      LeastArea(mesh.vertices, rim, edges).AddTo(&triangles);
    }
    if (triangles.size() == first) AddFan(rim, &mesh, &triangles);
    for (size_t i = first; i < triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        edges.insert(EdgeOf(triangles[i][k], triangles[i][kNextCorner[k]]));
      }
    }
    for (size_t i = 0; i < rim.size(); ++i) {
      grown.rims.push_back(EdgeOf(rim[i], rim[(i + 1) % rim.size()]));
    }
  }
  return GrowFaces(std::move(mesh), topology.vertex_count, grown, context);
}

}  // namespace rilievo
