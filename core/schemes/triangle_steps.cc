// Butterfly, sqrt(3).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/schemes/scheme_steps.h"

namespace rilievo {
namespace {

// The corners of a face seen from the edge under its half-edge k: its ends and the one opposite.
struct FaceAtEdge {
  int a, b, opposite;
};

FaceAtEdge AtEdge(const MeshTopology& topology, int face, int k) {
  return {topology.faces(k, face), topology.faces((k + 1) % 3, face),
          topology.faces((k + 2) % 3, face)};
}

class ButterflyMask {
 public:
  ButterflyMask(const MeshTopology& topology, const Eigen::Matrix3Xd& vertices)
      : topology_(topology), vertices_(vertices), rings_(BuildVertexRings(topology)) {}

  Eigen::Vector3d At(int edge) const {
    const int face = topology_.edge_faces(0, edge), across = topology_.edge_faces(1, edge);
    const FaceAtEdge here = AtEdge(topology_, face, CornerOfEdge(topology_, face, edge));
    if (across < 0) return OnBorder(here.a, here.b);
    const int irregular = (IsIrregular(here.a) ? 1 : 0) + (IsIrregular(here.b) ? 1 : 0);
    if (irregular > 0) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      if (IsIrregular(here.a)) sum += Beside(here.a, here.b);
      if (IsIrregular(here.b)) sum += Beside(here.b, here.a);
      return sum / irregular;
    }
    return (vertices_.col(here.a) + vertices_.col(here.b)) / 2 + Half(face, edge) +
           Half(across, edge);
  }

 private:
  int Valence(int v) const { return topology_.valence[static_cast<size_t>(v)]; }
  bool IsIrregular(int v) const {
    return topology_.boundary_vertex[static_cast<size_t>(v)] == 0 && Valence(v) != 6;
  }
  int Neighbor(int v, int i) const {
    return rings_.neighbors[static_cast<size_t>(rings_.neighbor_begin[static_cast<size_t>(v)] + i)];
  }

  // What the opposite corner and the two wings of one face add.
  Eigen::Vector3d Half(int face, int edge) const {
    const int k = CornerOfEdge(topology_, face, edge);
    return vertices_.col(AtEdge(topology_, face, k).opposite) / 8 -
           (Wing(face, (k + 1) % 3) + Wing(face, (k + 2) % 3)) / 16;
  }
  Eigen::Vector3d Wing(int face, int k) const {
    const int across = topology_.face_neighbors(k, face);
    if (across >= 0) {
      const int corner = CornerOfEdge(topology_, across, topology_.face_edges(k, face));
      return vertices_.col(AtEdge(topology_, across, corner).opposite);
    }
    const FaceAtEdge here = AtEdge(topology_, face, k);
    return vertices_.col(here.a) + vertices_.col(here.b) - vertices_.col(here.opposite);
  }

  Eigen::Vector3d Beside(int v, int first) const {
    const int k = Valence(v);
    int begin = 0;
    while (Neighbor(v, begin) != first) ++begin;
    Eigen::Vector3d point = 0.75 * vertices_.col(v);
    for (int j = 0; j < k; ++j) point += Weight(j, k) * vertices_.col(Neighbor(v, (begin + j) % k));
    return point;
  }
  static double Weight(int j, int k) {
    if (k == 3) return j == 0 ? 5.0 / 12 : -1.0 / 12;
    if (k == 4) return j == 0 ? 3.0 / 8 : j == 2 ? -1.0 / 8 : 0;
    const double angle = 2 * std::numbers::pi * j / k;
    return (0.25 + std::cos(angle) + std::cos(2 * angle) / 2) / k;
  }

  // The half-edge of the face runs from a to b, so the border goes on from b to its first
  // neighbour, and comes to a from its last one.
  Eigen::Vector3d OnBorder(int a, int b) const {
    return (9 * (vertices_.col(a) + vertices_.col(b)) - vertices_.col(Neighbor(b, 0)) -
            vertices_.col(Neighbor(a, Valence(a) - 1))) /
           16;
  }

  const MeshTopology& topology_;
  const Eigen::Matrix3Xd& vertices_;
  VertexRings rings_;
};

}  // namespace

Eigen::Matrix3Xd ButterflyPoints(const MeshTopology& topology, const Eigen::Matrix3Xd& vertices) {
  const ButterflyMask mask(topology, vertices);
  Eigen::Matrix3Xd points(3, topology.edge_count());
  for (int e = 0; e < topology.edge_count(); ++e) points.col(e) = mask.At(e);
  return points;
}

TriangleMesh Sqrt3Step(const MeshTopology& topology, const Eigen::Matrix3Xd& vertices,
                       bool split_border) {
  const VertexRings rings = BuildVertexRings(topology);
  std::vector<Eigen::Vector3d> points;
  for (int v = 0; v < topology.vertex_count; ++v) {
    const int begin = rings.neighbor_begin[static_cast<size_t>(v)],
              end = rings.neighbor_begin[static_cast<size_t>(v) + 1], n = end - begin;
    const auto neighbor = [&](int i) -> Eigen::Vector3d {
      return vertices.col(rings.neighbors[static_cast<size_t>(begin + i)]);
    };
    if (topology.boundary_vertex[static_cast<size_t>(v)] != 0) {
      points.push_back(
          split_border
              ? Eigen::Vector3d((4 * neighbor(0) + 19 * vertices.col(v) + 4 * neighbor(n - 1)) / 27)
              : Eigen::Vector3d(vertices.col(v)));
      continue;
    }
    const double alpha = (4 - 2 * std::cos(2 * std::numbers::pi / n)) / 9;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < n; ++i) sum += neighbor(i);
    points.emplace_back((1 - alpha) * vertices.col(v) + alpha / n * sum);
  }
  const auto add = [&](const Eigen::Vector3d& point) {
    points.push_back(point);
    return static_cast<int>(points.size()) - 1;
  };
  // By face and corner: what the triangle under the half-edge of that corner has for its apex.
  Eigen::Matrix3Xi apex(3, topology.face_count());
  std::vector<Eigen::Vector3i> faces;
  for (int f = 0; f < topology.face_count(); ++f) {
    int border = -1;
    for (int k = 0; k < 3; ++k) {
      if (topology.face_neighbors(k, f) < 0) border = k;
    }
    const FaceAtEdge at = AtEdge(topology, f, std::max(border, 0));
    if (border < 0 || !split_border) {
      apex.col(f).setConstant(
          add((vertices.col(at.a) + vertices.col(at.b) + vertices.col(at.opposite)) / 3));
      for (int k = 0; k < 3; ++k) {
        if (topology.face_neighbors(k, f) >= 0) continue;
        faces.emplace_back(topology.faces(k, f), topology.faces((k + 1) % 3, f), apex(0, f));
      }
      continue;
    }
    const auto last = [&](int v) { return rings.neighbor_begin[static_cast<size_t>(v) + 1] - 1; };
    const Eigen::Vector3d a = vertices.col(at.a), b = vertices.col(at.b),
                          before = vertices.col(rings.neighbors[static_cast<size_t>(last(at.a))]),
                          after = vertices.col(rings.neighbors[static_cast<size_t>(
                              rings.neighbor_begin[static_cast<size_t>(at.b)])]);
    const int p = add((before + 16 * a + 10 * b) / 27), q = add((10 * a + 16 * b + after) / 27);
    apex((border + 1) % 3, f) = q;
    apex((border + 2) % 3, f) = p;
    faces.emplace_back(p, q, at.opposite);
    // Along the border nothing is flipped.
    apex(border, f) = -1;
  }
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int across = topology.face_neighbors(k, f);
      if (across < 0) continue;
      const int edge = topology.face_edges(k, f);
      // Each side makes the triangle at the vertex where its half-edge begins.
      faces.emplace_back(topology.faces(k, f), apex(CornerOfEdge(topology, across, edge), across),
                         apex(k, f));
    }
  }
  TriangleMesh finer;
  finer.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  for (size_t i = 0; i < points.size(); ++i) {
    finer.vertices.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  finer.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t i = 0; i < faces.size(); ++i) {
    finer.triangles.col(static_cast<Eigen::Index>(i)) = faces[i];
  }
  return finer;
}

}  // namespace rilievo
