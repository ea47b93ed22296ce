// Catmull-Clark, Doo-Sabin.
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/schemes/scheme_steps.h"

namespace rilievo {
namespace {

Eigen::Vector3d CornerOf(const PolygonMesh& mesh, int h) {
  return mesh.vertices.col(mesh.corners[static_cast<size_t>(h)]);
}

}  // namespace

PolygonMesh CatmullClarkStep(const PolygonMesh& mesh, const PolygonTopology& topology) {
  const auto vertices = static_cast<int>(mesh.vertices.cols());
  const int edges = topology.edge_count(), faces = mesh.face_count();
  const auto at = PolygonTopology::At;
  PolygonMesh finer;
  finer.vertices.resize(3, vertices + edges + faces);
  for (int f = 0; f < faces; ++f) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int v : mesh.Face(f)) sum += mesh.vertices.col(v);
    finer.vertices.col(vertices + edges + f) = sum / static_cast<double>(mesh.Face(f).size());
  }
  const auto face_point = [&](int h) -> Eigen::Vector3d {
    return finer.vertices.col(vertices + edges + at(topology.face, h));
  };
  for (int e = 0; e < edges; ++e) {
    const int h = at(topology.edge_half_edges, e), twin = at(topology.twin, h);
    const Eigen::Vector3d middle = (CornerOf(mesh, h) + CornerOf(mesh, at(topology.next, h))) / 2;
    finer.vertices.col(vertices + e) =
        twin < 0 ? middle : (2 * middle + face_point(h) + face_point(twin)) / 4;
  }
  for (int v = 0; v < vertices; ++v) {
    const Eigen::Vector3d own = mesh.vertices.col(v);
    const std::vector<int> ring = topology.Ring(v);
    if (topology.OnBorder(v)) {
      finer.vertices.col(v) =
          0.75 * own + 0.125 * (CornerOf(mesh, at(topology.next, ring[0])) +
                                CornerOf(mesh, at(topology.previous, ring.back())));
      continue;
    }
    const auto n = static_cast<double>(ring.size());
    Eigen::Vector3d face_points = Eigen::Vector3d::Zero(), tips = Eigen::Vector3d::Zero();
    for (const int h : ring) {
      face_points += face_point(h);
      tips += CornerOf(mesh, at(topology.next, h));
    }
    // 2 R = v + the mean of the tips.
    finer.vertices.col(v) = (face_points / n + tips / n + (n - 2) * own) / n;
  }
  for (int h = 0; h < static_cast<int>(mesh.corners.size()); ++h) {
    finer.AddFace(std::array{mesh.corners[static_cast<size_t>(h)], vertices + at(topology.edge, h),
                             vertices + edges + at(topology.face, h),
                             vertices + at(topology.edge, at(topology.previous, h))});
  }
  return finer;
}

PolygonMesh DooSabinStep(const PolygonMesh& mesh, const PolygonTopology& topology) {
  const auto half_edges = static_cast<int>(mesh.corners.size());
  const auto at = PolygonTopology::At;
  // By half-edge on the border: the point near its origin; the next one is near its tip.
  std::vector<int> on_border(static_cast<size_t>(half_edges), -1);
  int points = half_edges;
  for (int h = 0; h < half_edges; ++h) {
    if (at(topology.twin, h) >= 0) continue;
    on_border[static_cast<size_t>(h)] = points;
    points += 2;
  }
  PolygonMesh finer;
  finer.vertices.resize(3, points);
  for (int f = 0; f < mesh.face_count(); ++f) {
    const int first = mesh.begin[static_cast<size_t>(f)];
    const auto n = static_cast<int>(mesh.Face(f).size());
    std::vector<int> face;
    for (int i = 0; i < n; ++i) {
      Eigen::Vector3d point = (n + 5.0) / (4 * n) * CornerOf(mesh, first + i);
      for (int j = 0; j < n; ++j) {
        if (j == i) continue;
        point += (3 + 2 * std::cos(2 * std::numbers::pi * (i - j) / n)) / (4 * n) *
                 CornerOf(mesh, first + j);
      }
      finer.vertices.col(first + i) = point;
      face.push_back(first + i);
    }
    finer.AddFace(face);
  }
  for (const int h : topology.edge_half_edges) {
    const int twin = at(topology.twin, h), next = at(topology.next, h);
    if (twin >= 0) {
      finer.AddFace(std::array{next, h, at(topology.next, twin), twin});
      continue;
    }
    const int near_origin = at(on_border, h);
    const Eigen::Vector3d from = CornerOf(mesh, h), to = CornerOf(mesh, next);
    finer.vertices.col(near_origin) = 0.75 * from + 0.25 * to;
    finer.vertices.col(near_origin + 1) = 0.25 * from + 0.75 * to;
    finer.AddFace(std::array{next, h, near_origin, near_origin + 1});
  }
  for (int v = 0; v < static_cast<int>(mesh.vertices.cols()); ++v) {
    std::vector<int> face = topology.Ring(v);
    if (topology.OnBorder(v)) {
      face.push_back(at(on_border, at(topology.previous, face.back())) + 1);
      face.push_back(at(on_border, face[0]));
    }
    // Two faces around an interior vertex leave nothing between their points.
    if (face.size() > 2) finer.AddFace(face);
  }
  return finer;
}

}  // namespace rilievo
