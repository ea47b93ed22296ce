// Domains and clouds with known heights, for the tests of the displacement stage.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "core/displacement/sample_displacement.h"
#include "core/loop/refinement.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo::testing {

inline RunContext Threads(int threads) {
  RunContext context;
  context.threads = threads;
  return context;
}

// Octahedron refined `rounds` times onto the sphere of `radius`.
inline ControlMesh Octahedron(double radius, int rounds) {
  ControlMesh mesh;
  mesh.vertices.resize(3, 6);
  mesh.vertices << 1, -1, 0, 0, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 0, 0, 1, -1;
  mesh.faces.resize(3, 8);
  mesh.faces << 0, 2, 1, 3, 2, 1, 3, 0, 2, 1, 3, 0, 0, 2, 1, 3, 4, 4, 4, 4, 5, 5, 5, 5;
  for (int round = 0; round < rounds; ++round) {
    const LoopRefinement refinement = *RefineTopology(mesh, 1, RunContext());
    const MeshTopology& coarse = refinement.levels[0];
    Eigen::Matrix3Xd vertices(3, refinement.levels[1].vertex_count);
    vertices.leftCols(coarse.vertex_count) = mesh.vertices;
    for (int edge = 0; edge < coarse.edge_count(); ++edge) {
      vertices.col(coarse.vertex_count + edge) = mesh.vertices.col(coarse.edge_vertices(0, edge)) +
                                                 mesh.vertices.col(coarse.edge_vertices(1, edge));
    }
    mesh.vertices = vertices;
    mesh.faces = refinement.levels[1].faces;
  }
  for (auto vertex : mesh.vertices.colwise()) vertex *= radius / vertex.norm();
  return mesh;
}

// A flat sheet of 2 cells x cells triangles over [-half, half]^2 at height z, facing +z.
inline ControlMesh Sheet(double half, int cells, double z = 0) {
  ControlMesh mesh;
  mesh.vertices.resize(3, (cells + 1) * (cells + 1));
  mesh.faces.resize(3, 2 * cells * cells);
  for (int y = 0; y <= cells; ++y) {
    for (int x = 0; x <= cells; ++x) {
      mesh.vertices.col(y * (cells + 1) + x) << half * (2.0 * x / cells - 1),
          half * (2.0 * y / cells - 1), z;
    }
  }
  for (int y = 0, face = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const int a = y * (cells + 1) + x, b = a + 1, c = a + cells + 1, d = c + 1;
      mesh.faces.col(face++) << a, b, d;
      mesh.faces.col(face++) << a, d, c;
    }
  }
  return mesh;
}

struct Domain {
  LoopRefinement refinement;
  VertexRings rings;
  LimitSurface limit;
  int size() const { return static_cast<int>(limit.positions.cols()); }
};

inline Domain MakeDomain(const ControlMesh& mesh, int level) {
  Domain domain;
  domain.refinement = *RefineTopology(mesh, level, RunContext());
  domain.rings = BuildVertexRings(domain.refinement.levels.back());
  domain.limit = *EvaluateLimit(domain.refinement, mesh.vertices, level, RunContext());
  return domain;
}

struct Scan {
  OrientedCloud cloud;
};

// A scan of points with normals; spacing from the neighbours, `noise` as stated.
inline Scan MakeScan(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& normals,
                     double noise) {
  Scan scan;
  const NeighborGraph graph =
      *BuildNeighborGraph(PointIndex(points), points, NeighborOptions(), RunContext());
  scan.cloud.points = points;
  scan.cloud.normals = normals;
  const int k = graph.k;
  for (int i = 0; i < points.cols(); ++i) {
    const float farthest = NeighborDistances(points, graph, i)[k - 1];
    scan.cloud.spacing.push_back(2 * farthest / std::sqrt(static_cast<float>(k)));
    scan.cloud.noise.push_back(static_cast<float>(noise));
    scan.cloud.median_spacing += scan.cloud.spacing.back() / points.cols();
  }
  scan.cloud.median_noise = noise;
  return scan;
}

// Nearly even directions on the unit sphere (golden spiral).
inline Eigen::Vector3d SpiralDirection(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count;
  const double turn = i * M_PI * (3 - std::sqrt(5.0));
  const double across = std::sqrt(1 - z * z);
  return {across * std::cos(turn), across * std::sin(turn), z};
}

using Random = std::mt19937_64;
inline double Uniform(Random* random, double low, double high) {
  return low + (high - low) * static_cast<double>((*random)() >> 11) * 0x1.0p-53;
}
inline double Gauss(Random* random) {  // Box-Muller; the same numbers on every library
  const double radius = std::sqrt(-2 * std::log(1 - Uniform(random, 0, 1)));
  return radius * std::cos(2 * M_PI * Uniform(random, 0, 1));
}

struct Points {
  std::vector<Eigen::Vector3d> at, normal;
  void Add(const Eigen::Vector3d& position, const Eigen::Vector3d& outward) {
    at.push_back(position);
    normal.push_back(outward.normalized());
  }
  Eigen::Matrix3Xd Positions() const { return Columns(at); }
  Eigen::Matrix3Xd Normals() const { return Columns(normal); }
  static Eigen::Matrix3Xd Columns(const std::vector<Eigen::Vector3d>& list) {
    Eigen::Matrix3Xd columns(3, list.size());
    for (size_t i = 0; i < list.size(); ++i) columns.col(i) = list[i];
    return columns;
  }
};

inline Points SpherePoints(double radius, int count) {
  Points points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d direction = SpiralDirection(i, count);
    points.Add(radius * direction, direction);
  }
  return points;
}

inline Scan SphereScan(double radius, int count) {
  const Points points = SpherePoints(radius, count);
  return MakeScan(points.Positions(), points.Normals(), 0);
}

// `count` points of z = height(x, y) over [-half, half]^2, jittered off a grid.
inline Points HeightFieldPoints(double half, int count, Random* random,
                                const std::function<double(double, double)>& height) {
  Points points;
  const int side = static_cast<int>(std::sqrt(count));
  constexpr double kStep = 1e-5;
  for (int i = 0; i < side * side; ++i) {
    const double x = half * (2 * (i % side + Uniform(random, 0.1, 0.9)) / side - 1);
    const double y = half * (2 * (i / side + Uniform(random, 0.1, 0.9)) / side - 1);
    const double slope_x = (height(x + kStep, y) - height(x - kStep, y)) / (2 * kStep);
    const double slope_y = (height(x, y + kStep) - height(x, y - kStep)) / (2 * kStep);
    points.Add({x, y, height(x, y)}, {-slope_x, -slope_y, 1});
  }
  return points;
}

// Signed distance along the ray from `position` to the sphere about the origin.
inline double SphereHeight(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                           double radius) {
  const double along = position.dot(normal);
  return -along + std::sqrt(along * along - position.squaredNorm() + radius * radius);
}

inline DisplacementField Sample(const Scan& scan, const Domain& domain,
                                const DisplacementOptions& options = DisplacementOptions(),
                                int threads = 2) {
  auto field = SampleDisplacement(scan.cloud, domain.refinement, domain.rings, domain.limit,
                                  options, Threads(threads));
  return *std::move(field);
}

// Difference of the heights to the truth over the vertices that `counts` accepts.
struct HeightError {
  double rms = 0, max = 0;
  int count = 0;
};
inline HeightError Compare(
    const DisplacementField& field, const std::function<double(int)>& truth,
    const std::function<bool(int)>& counts = [](int) { return true; }) {
  HeightError error;
  for (int v = 0; v < static_cast<int>(field.heights.size()); ++v) {
    if (!counts(v)) continue;
    const double off = field.heights[v] - truth(v);
    error.rms += off * off;
    error.max = std::max(error.max, std::abs(off));
    ++error.count;
  }
  error.rms = std::sqrt(error.rms / std::max(error.count, 1));
  return error;
}

}  // namespace rilievo::testing
