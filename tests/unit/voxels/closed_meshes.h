// Closed meshes of known shapes.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

inline TriangleMesh MeshOf(const std::vector<Eigen::Vector3d>& vertices,
                           const std::vector<std::array<int, 3>>& triangles) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t v = 0; v < vertices.size(); ++v) {
    mesh.vertices.col(static_cast<Eigen::Index>(v)) = vertices[v];
  }
  for (size_t t = 0; t < triangles.size(); ++t) {
    mesh.triangles.col(static_cast<Eigen::Index>(t)) = Eigen::Vector3i(triangles[t].data());
  }
  return mesh;
}

// Both in one, not joined.
inline TriangleMesh Together(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  mesh.vertices << a.vertices, b.vertices;
  mesh.triangles.resize(3, a.triangles.cols() + b.triangles.cols());
  mesh.triangles << a.triangles, b.triangles.array() + static_cast<int>(a.vertices.cols());
  return mesh;
}

inline TriangleMesh InsideOut(TriangleMesh mesh) {
  mesh.triangles.row(1).swap(mesh.triangles.row(2));
  return mesh;
}

inline TriangleMesh BoxMesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                         (i & 4) != 0 ? high.z() : low.z());
  }
  return MeshOf(corners, {{0, 2, 3},
                          {0, 3, 1},
                          {4, 5, 7},
                          {4, 7, 6},
                          {0, 1, 5},
                          {0, 5, 4},
                          {2, 6, 7},
                          {2, 7, 3},
                          {0, 4, 6},
                          {0, 6, 2},
                          {1, 3, 7},
                          {1, 7, 5}});
}

// Around z, of n times m quads; vertices on the torus.
inline TriangleMesh TorusMesh(double ring, double tube, int n, int m) {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * j / m;
      const double radius = ring + tube * std::cos(v);
      vertices.emplace_back(radius * std::cos(u), radius * std::sin(u), tube * std::sin(v));
      const int across = (i + 1) % n, along = (j + 1) % m;
      triangles.push_back({i * m + j, across * m + j, across * m + along});
      triangles.push_back({i * m + j, across * m + along, i * m + along});
    }
  }
  return MeshOf(vertices, triangles);
}

// An octahedron quartered `rounds` times; vertices on the sphere of radius 1 around 0.
inline TriangleMesh SphereMesh(int rounds) {
  std::vector<Eigen::Vector3d> vertices = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                           {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  std::vector<std::array<int, 3>> triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                               {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (; rounds > 0; --rounds) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, made] = middles.emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
      if (made) {
        vertices.push_back(
            (vertices[static_cast<size_t>(a)] + vertices[static_cast<size_t>(b)]).normalized());
      }
      return at->second;
    };
    std::vector<std::array<int, 3>> quarters;
    for (const auto& [a, b, c] : triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      quarters.insert(quarters.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(quarters);
  }
  return MeshOf(vertices, triangles);
}

inline TriangleMesh Moved(TriangleMesh mesh, const Eigen::Affine3d& motion) {
  mesh.vertices = motion * mesh.vertices;
  return mesh;
}

// A turn that is along no axis.
inline Eigen::Affine3d Askew() {
  return Eigen::Affine3d(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
}

// A place on a triangle of the mesh, each triangle as likely as any other.
inline Eigen::Vector3d RandomPlace(const TriangleMesh& mesh, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::uniform_int_distribution<Eigen::Index> triangle(0, mesh.triangles.cols() - 1);
  const auto corners = mesh.triangles.col(triangle(random));
  double u = unit(random), v = unit(random);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return (1 - u - v) * mesh.vertices.col(corners[0]) + u * mesh.vertices.col(corners[1]) +
         v * mesh.vertices.col(corners[2]);
}

}  // namespace rilievo
