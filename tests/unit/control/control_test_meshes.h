// Meshes and clouds of known shape for the tests of this room.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/control/simplify/half_edge_mesh.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

using Field = std::function<double(const Eigen::Vector3d&)>;  // negative inside

// The zero set of `field` in the box [-half, half]^3 by marching tetrahedra on n^3 cubes: a closed
// manifold (when it stays off the box' sides) as full of slivers as an iso-surface can be.
inline ControlMesh MarchTetrahedra(const Field& field, int n, double half = 0.5) {
  const int side = n + 1;
  const auto position = [&](int node) -> Eigen::Vector3d {
    const Eigen::Vector3d cell(node % side, node / side % side, node / side / side);
    return cell * (2 * half / n) - Eigen::Vector3d::Constant(half);
  };
  std::vector<double> value(static_cast<size_t>(side) * side * side);
  for (int node = 0; node < static_cast<int>(value.size()); ++node) {
    value[node] = field(position(node));
  }
  std::map<std::pair<int, int>, int> crossings;
  std::vector<Eigen::Vector3d> vertices, middles;  // middles: of the crossed edges
  std::vector<Eigen::Vector3i> faces;
  const auto crossing = [&](int a, int b) {
    const auto key = std::minmax(a, b);
    const auto [place, added] = crossings.try_emplace(key, static_cast<int>(vertices.size()));
    if (added) {
      const double t = value[key.first] / (value[key.first] - value[key.second]);
      const Eigen::Vector3d p = position(key.first), q = position(key.second);
      vertices.push_back(p + t * (q - p));
      middles.push_back((p + q) / 2);
    }
    return place->second;
  };
  constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
      {{0, 5, 1, 6}, {0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}}};
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const auto node = [&](int i, int j, int k) {
          return ((z + k) * side + y + j) * side + x + i;
        };
        const int corners[8] = {node(0, 0, 0), node(1, 0, 0), node(1, 1, 0), node(0, 1, 0),
                                node(0, 0, 1), node(1, 0, 1), node(1, 1, 1), node(0, 1, 1)};
        for (const auto& tetrahedron : kTetrahedra) {
          std::vector<int> in, out;
          for (const int corner : tetrahedron) {
            (value[corners[corner]] < 0 ? in : out).push_back(corners[corner]);
          }
          if (in.empty() || out.empty()) continue;
          const Eigen::Vector3d outward = position(out[0]) - position(in[0]);
          const auto add = [&](int a, int b, int c) {
            const Eigen::Vector3d normal = (middles[b] - middles[a]).cross(middles[c] - middles[a]);
            if (normal.dot(outward) < 0) std::swap(b, c);
            faces.emplace_back(a, b, c);
          };
          if (in.size() == 2) {
            const int a = crossing(in[0], out[0]), b = crossing(in[0], out[1]);
            const int c = crossing(in[1], out[1]), d = crossing(in[1], out[0]);
            add(a, b, c);
            add(a, c, d);
          } else {
            const int alone = in.size() == 1 ? in[0] : out[0];
            const std::vector<int>& rest = in.size() == 1 ? out : in;
            add(crossing(alone, rest[0]), crossing(alone, rest[1]), crossing(alone, rest[2]));
          }
        }
      }
    }
  }
  ControlMesh mesh;
  mesh.vertices.resize(3, static_cast<int64_t>(vertices.size()));
  for (size_t v = 0; v < vertices.size(); ++v)
    mesh.vertices.col(static_cast<int64_t>(v)) = vertices[v];
  mesh.faces.resize(3, static_cast<int64_t>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.col(static_cast<int64_t>(f)) = faces[f];
  return mesh;
}

// Off the lattice by odd amounts, so that no node lies on the surface.
inline const Eigen::Vector3d kOffset(0.00317, 0.00171, 0.00233);

inline double SphereField(const Eigen::Vector3d& x) { return (x - kOffset).norm() - 0.4; }

inline double TorusField(const Eigen::Vector3d& point, double ring = 0.3, double tube = 0.12) {
  const Eigen::Vector3d x = point - kOffset;
  return std::hypot(std::hypot(x.x(), x.y()) - ring, x.z()) - tube;
}

inline double TwoToriField(const Eigen::Vector3d& x) {
  const double left = TorusField(x + Eigen::Vector3d(0.22, 0, 0), 0.16, 0.07);
  const double right = TorusField(x - Eigen::Vector3d(0.22, 0, 0), 0.16, 0.07);
  return std::min(left, right);
}

inline double TwoSpheresField(const Eigen::Vector3d& x) {
  return std::min((x - kOffset - Eigen::Vector3d(0.2, 0, 0)).norm() - 0.2,
                  (x - kOffset + Eigen::Vector3d(0.3, 0, 0)).norm() - 0.1);
}

// Columns x rows vertices, row by row; position(s, t) with s, t in [0, 1]. When `wrap`, the last
// column is joined to the first.
inline ControlMesh Sheet(int columns, int rows, bool wrap,
                         const std::function<Eigen::Vector3d(double, double)>& position) {
  ControlMesh mesh;
  mesh.vertices.resize(3, static_cast<int64_t>(columns) * rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      mesh.vertices.col(r * columns + c) =
          position(c / (wrap ? double(columns) : columns - 1.0), r / (rows - 1.0));
    }
  }
  std::vector<Eigen::Vector3i> faces;
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + (wrap ? 0 : 1) < columns; ++c) {
      const int a = r * columns + c, b = r * columns + (c + 1) % columns;
      faces.emplace_back(a, b, b + columns);
      faces.emplace_back(a, b + columns, a + columns);
    }
  }
  mesh.faces.resize(3, static_cast<int64_t>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.col(static_cast<int64_t>(f)) = faces[f];
  return mesh;
}

inline ControlMesh OpenCylinder(int around, int along) {
  return Sheet(around, along, true, [](double s, double t) -> Eigen::Vector3d {
    const double angle = 2 * std::numbers::pi * s;
    return {0.2 * std::cos(angle), 0.2 * std::sin(angle), 0.8 * (t - 0.5)};
  });
}

inline TopologySummary Summary(const ControlMesh& mesh) {
  return SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
}

inline std::vector<int> Valences(const ControlMesh& mesh) {
  const auto half_edges =
      HalfEdgeMesh::Build(mesh.faces, static_cast<int>(mesh.vertices.cols()), RunContext{});
  std::vector<int> valences;
  for (int v = 0; half_edges.ok() && v < half_edges->vertex_slots(); ++v) {
    valences.push_back(half_edges->Valence(v));
  }
  return valences;
}

// 1 for an equilateral triangle, 0 for a degenerate one.
inline std::vector<double> Roundnesses(const ControlMesh& mesh) {
  std::vector<double> roundnesses;
  for (const auto& face : mesh.faces.colwise()) {
    const Eigen::Vector3d a = mesh.vertices.col(face[0]), b = mesh.vertices.col(face[1]),
                          c = mesh.vertices.col(face[2]);
    const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    roundnesses.push_back(2 * std::numbers::sqrt3 * (b - a).cross(c - a).norm() / edges);
  }
  return roundnesses;
}

inline double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// Largest |field| over a sampling of the faces.
inline double LargestField(const ControlMesh& mesh, const Field& field) {
  double largest = 0;
  for (const auto& face : mesh.faces.colwise()) {
    for (int i = 0; i <= 4; ++i) {
      for (int j = 0; i + j <= 4; ++j) {
        const Eigen::Vector3d x = (i * mesh.vertices.col(face[0]) + j * mesh.vertices.col(face[1]) +
                                   (4 - i - j) * mesh.vertices.col(face[2])) /
                                  4.0;
        largest = std::max(largest, std::abs(field(x)));
      }
    }
  }
  return largest;
}

// A cloud with the spacing that its own points have, scaled to the unit frame unless it is in it.
inline OrientedCloud MakeCloud(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& normals) {
  OrientedCloud cloud;
  cloud.points = points;
  cloud.normals = normals;
  const PointIndex index(points);
  constexpr int kNeighbors = 12;
  for (int i = 0; i < points.cols(); ++i) {
    int indices[kNeighbors + 1];
    double squared[kNeighbors + 1];
    index.Nearest(points.col(i), kNeighbors + 1, indices, squared);
    cloud.spacing.push_back(static_cast<float>(std::sqrt(4 * squared[kNeighbors] / kNeighbors)));
    cloud.noise.push_back(0);
  }
  std::vector<float> sorted = cloud.spacing;
  std::sort(sorted.begin(), sorted.end());
  cloud.median_spacing = sorted[sorted.size() / 2];
  return cloud;
}

// `count` points in a spiral over the unit sphere, area-uniform.
inline Eigen::Matrix3Xd SphereDirections(int count) {
  Eigen::Matrix3Xd directions(3, count);
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    directions.col(i) = Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z);
  }
  return directions;
}

inline OrientedCloud SphereCloud(int count, double radius = 0.28,
                                 const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  const Eigen::Matrix3Xd directions = SphereDirections(count);
  return MakeCloud((radius * directions).colwise() + center, directions);
}

// Radius of a bumpy star-shaped body along a unit direction.
inline double StarRadius(const Eigen::Vector3d& direction) {
  return 0.25 + 0.04 * std::sin(4 * direction.x()) + 0.03 * std::cos(5 * direction.y()) +
         0.02 * direction.z();
}

inline OrientedCloud StarCloud(int count) {
  Eigen::Matrix3Xd points = SphereDirections(count), normals(3, count);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d d = points.col(i);
    const double radius = StarRadius(d);
    // The surface is F(x) = |x| - R(x / |x|) = 0; grad F = d - (I - d d^T) grad R / |x|.
    const Eigen::Vector3d slope(0.16 * std::cos(4 * d.x()), -0.15 * std::sin(5 * d.y()), 0.02);
    normals.col(i) = (d - (slope - slope.dot(d) * d) / radius).normalized();
    points.col(i) = radius * d;
  }
  return MakeCloud(points, normals);
}

inline OrientedCloud TorusCloud(int around, int along) {
  Eigen::Matrix3Xd points(3, around * along), normals(3, around * along);
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < along; ++j) {
      const double u = 2 * std::numbers::pi * i / around;
      const double v = 2 * std::numbers::pi * (j + 0.5 * (i & 1)) / along;
      const Eigen::Vector3d normal(std::cos(v) * std::cos(u), std::cos(v) * std::sin(u),
                                   std::sin(v));
      normals.col(i * along + j) = normal;
      points.col(i * along + j) =
          Eigen::Vector3d(0.25 * std::cos(u), 0.25 * std::sin(u), 0) + 0.1 * normal;
    }
  }
  return MakeCloud(points, normals);
}

inline double WavyHeight(double x, double y) {
  return 0.03 * std::sin(9 * x) * std::cos(8 * y) + 0.02 * x;
}

// A terrain over a square of side 0.7 with a round hole of `hole` radius at (0.1, 0.05), turned
// and moved by `pose`. Low-discrepancy positions.
inline OrientedCloud TerrainCloud(int count, double hole,
                                  const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity()) {
  std::vector<Eigen::Vector3d> points, normals;
  for (int i = 0; i < count; ++i) {
    double whole = 0;
    const double x = 0.7 * (std::modf(0.5 + i * 0.7548776662466927, &whole) - 0.5);
    const double y = 0.7 * (std::modf(0.5 + i * 0.5698402909980532, &whole) - 0.5);
    if (std::hypot(x - 0.1, y - 0.05) < hole) continue;
    points.push_back(pose * Eigen::Vector3d(x, y, WavyHeight(x, y)));
    const Eigen::Vector3d normal(-0.27 * std::cos(9 * x) * std::cos(8 * y) - 0.02,
                                 0.24 * std::sin(9 * x) * std::sin(8 * y), 1);
    normals.push_back(pose.linear() * normal.normalized());
  }
  Eigen::Matrix3Xd p(3, static_cast<int64_t>(points.size())), n(3, p.cols());
  for (size_t i = 0; i < points.size(); ++i) {
    p.col(static_cast<int64_t>(i)) = points[i];
    n.col(static_cast<int64_t>(i)) = normals[i];
  }
  return MakeCloud(p, n);
}

inline OrientedCloud Joined(const OrientedCloud& a, const OrientedCloud& b) {
  Eigen::Matrix3Xd points(3, a.points.cols() + b.points.cols()), normals(3, points.cols());
  points << a.points, b.points;
  normals << a.normals, b.normals;
  return MakeCloud(points, normals);
}

inline RunContext Stopped() {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  return context;
}

}  // namespace rilievo
