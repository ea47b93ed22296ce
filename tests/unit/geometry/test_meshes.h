// Meshes whose connectivity is known by construction, for the tests of geometry and loop.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <utility>
#include <vector>

#include "core/geometry/triangle_mesh.h"

namespace rilievo::testing {

inline Eigen::Matrix3Xi Faces(std::initializer_list<std::array<int, 3>> list) {
  Eigen::Matrix3Xi faces(3, static_cast<Eigen::Index>(list.size()));
  int f = 0;
  for (const auto& face : list) faces.col(f++) << face[0], face[1], face[2];
  return faces;
}

// The same sequence with every standard library.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  uint64_t Next() {  // splitmix64
    uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  int Below(int bound) { return static_cast<int>(Next() % static_cast<uint64_t>(bound)); }
  double Signed() { return static_cast<double>(Next() >> 11) * 0x1p-52 - 1.0; }  // [-1, 1)
  Eigen::Vector3d Vector() { return {Signed(), Signed(), Signed()}; }

 private:
  uint64_t state_;
};

inline ControlMesh Tetrahedron() {
  ControlMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 1, -1, -1, 1, 1, -1, 1, -1, 1, 1, -1, -1;
  mesh.faces = Faces({{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}});
  if ((mesh.vertices.col(1) - mesh.vertices.col(0))
          .cross(mesh.vertices.col(2) - mesh.vertices.col(0))
          .dot(mesh.vertices.col(0)) < 0) {
    mesh.faces.row(1).swap(mesh.faces.row(2));
  }
  return mesh;
}

// Twelve faces, two a side. Bit k of a vertex' number tells its end of axis k.
inline ControlMesh Box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  ControlMesh box;
  box.vertices.resize(3, 8);
  for (int v = 0; v < 8; ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      box.vertices(axis, v) = ((v >> axis) & 1) != 0 ? high[axis] : low[axis];
    }
  }
  box.faces = Faces({{0, 2, 3},
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
  return box;
}

// Two poles over a ring of `valence` vertices; an octahedron for 4. Vertices 0 and 1: the poles.
inline ControlMesh Bipyramid(int valence) {
  ControlMesh mesh;
  mesh.vertices.resize(3, valence + 2);
  mesh.faces.resize(3, 2 * valence);
  mesh.vertices.col(0) << 0, 0, 1;
  mesh.vertices.col(1) << 0, 0, -1;
  for (int i = 0; i < valence; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / valence;
    mesh.vertices.col(2 + i) << std::cos(angle), std::sin(angle), 0;
    const int a = 2 + i, b = 2 + (i + 1) % valence;
    mesh.faces.col(2 * i) << 0, a, b;
    mesh.faces.col(2 * i + 1) << 1, b, a;
  }
  return mesh;
}

inline ControlMesh Icosahedron() {
  // A pentagonal antiprism with two poles.
  ControlMesh mesh;
  mesh.vertices.resize(3, 12);
  mesh.faces.resize(3, 20);
  const double height = 1.0 / std::sqrt(5.0), radius = 2.0 / std::sqrt(5.0);
  mesh.vertices.col(0) << 0, 0, 1;
  mesh.vertices.col(11) << 0, 0, -1;
  for (int i = 0; i < 5; ++i) {
    const double upper = 2.0 * std::numbers::pi * i / 5, lower = upper + std::numbers::pi / 5;
    mesh.vertices.col(1 + i) << radius * std::cos(upper), radius * std::sin(upper), height;
    mesh.vertices.col(6 + i) << radius * std::cos(lower), radius * std::sin(lower), -height;
    const int a = 1 + i, b = 1 + (i + 1) % 5, c = 6 + i, d = 6 + (i + 1) % 5;
    mesh.faces.col(4 * i) << 0, a, b;
    mesh.faces.col(4 * i + 1) << a, c, b;
    mesh.faces.col(4 * i + 2) << b, c, d;
    mesh.faces.col(4 * i + 3) << 11, d, c;
  }
  return mesh;
}

// columns x rows vertices over the unit square, all diagonals alike; open.
inline ControlMesh Grid(int columns, int rows) {
  ControlMesh mesh;
  mesh.vertices.resize(3, columns * rows);
  mesh.faces.resize(3, 2 * (columns - 1) * (rows - 1));
  int f = 0;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const int v = y * columns + x;
      mesh.vertices.col(v) << x / (columns - 1.0), y / (rows - 1.0), 0.0;
      if (x + 1 == columns || y + 1 == rows) continue;
      mesh.faces.col(f++) << v, v + 1, v + columns + 1;
      mesh.faces.col(f++) << v, v + columns + 1, v + columns;
    }
  }
  return mesh;
}

// Regular (valence 6) torus of `around` x `across` vertices, both at least 3.
inline ControlMesh Torus(int around, int across) {
  ControlMesh mesh;
  mesh.vertices.resize(3, around * across);
  mesh.faces.resize(3, 2 * around * across);
  int f = 0;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double u = 2.0 * std::numbers::pi * i / around, v = 2.0 * std::numbers::pi * j / across;
      const double radius = 1.0 + 0.4 * std::cos(v);
      const int i1 = (i + 1) % around, j1 = (j + 1) % across;
      mesh.vertices.col(i * across + j) << radius * std::cos(u), radius * std::sin(u),
          0.4 * std::sin(v);
      const int a = i * across + j, b = i1 * across + j, c = i1 * across + j1, d = i * across + j1;
      mesh.faces.col(f++) << a, b, c;
      mesh.faces.col(f++) << a, c, d;
    }
  }
  return mesh;
}

// A flat open fan: vertex 0 on the boundary with `faces` faces around it, over a half disk.
inline ControlMesh HalfFan(int faces) {
  ControlMesh mesh;
  mesh.vertices.resize(3, faces + 2);
  mesh.faces.resize(3, faces);
  mesh.vertices.col(0).setZero();
  for (int i = 0; i <= faces; ++i) {
    const double angle = std::numbers::pi * i / faces * (faces == 1 ? 0.5 : 1.0);
    mesh.vertices.col(1 + i) << std::cos(angle), std::sin(angle), 0;
    if (i < faces) mesh.faces.col(i) << 0, 1 + i, 2 + i;
  }
  return mesh;
}

inline ControlMesh Union(const ControlMesh& a, const ControlMesh& b) {
  ControlMesh both;
  both.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  both.vertices << a.vertices, b.vertices;
  both.faces.resize(3, a.faces.cols() + b.faces.cols());
  both.faces << a.faces, b.faces.array() + static_cast<int>(a.vertices.cols());
  return both;
}

// The connected sum: both lose their last face and are sewn together there.
inline ControlMesh ConnectedSum(const ControlMesh& a, const ControlMesh& b) {
  const Eigen::Vector3i hole_a = a.faces.rightCols<1>(), hole_b = b.faces.rightCols<1>();
  const int offset = static_cast<int>(a.vertices.cols());
  std::vector<int> renamed(static_cast<size_t>(b.vertices.cols()), -1);
  for (int k = 0; k < 3; ++k) renamed[static_cast<size_t>(hole_b[k])] = hole_a[(3 - k) % 3];
  int next = offset;
  ControlMesh sum;
  sum.vertices.resize(3, offset + b.vertices.cols() - 3);
  sum.vertices.leftCols(offset) = a.vertices;
  for (size_t v = 0; v < renamed.size(); ++v) {
    if (renamed[v] >= 0) continue;
    sum.vertices.col(next) =
        b.vertices.col(static_cast<Eigen::Index>(v)) + Eigen::Vector3d(3, 0, 0);
    renamed[v] = next++;
  }
  const Eigen::Index kept_a = a.faces.cols() - 1, kept_b = b.faces.cols() - 1;
  sum.faces.resize(3, kept_a + kept_b);
  sum.faces.leftCols(kept_a) = a.faces.leftCols(kept_a);
  for (Eigen::Index f = 0; f < kept_b; ++f) {
    for (int k = 0; k < 3; ++k) {
      sum.faces(k, kept_a + f) = renamed[static_cast<size_t>(b.faces(k, f))];
    }
  }
  return sum;
}

// A new vertex in the middle of each of `count` random faces: valences from 3 upwards.
inline ControlMesh SplitRandomFaces(ControlMesh mesh, int count, Random& random) {
  for (int i = 0; i < count; ++i) {
    const Eigen::Index f = random.Below(static_cast<int>(mesh.faces.cols()));
    const Eigen::Vector3i face = mesh.faces.col(f);
    const int middle = static_cast<int>(mesh.vertices.cols());
    mesh.vertices.conservativeResize(3, middle + 1);
    mesh.vertices.col(middle) =
        (mesh.vertices.col(face[0]) + mesh.vertices.col(face[1]) + mesh.vertices.col(face[2])) /
        3.0;
    mesh.faces.col(f) << face[0], face[1], middle;
    mesh.faces.conservativeResize(3, mesh.faces.cols() + 2);
    mesh.faces.rightCols<2>() << face[1], face[2], face[2], face[0], middle, middle;
  }
  return mesh;
}

inline ControlMesh Perturbed(ControlMesh mesh, double amount, Random& random) {
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices.col(v) += amount * random.Vector();
  }
  return mesh;
}

inline Eigen::Matrix3Xi WithShuffledFaces(Eigen::Matrix3Xi faces, Random& random) {
  for (int f = static_cast<int>(faces.cols()) - 1; f > 0; --f) {
    faces.col(f).swap(faces.col(random.Below(f + 1)));
    const Eigen::Vector3i face = faces.col(f);
    const int turn = random.Below(3);
    for (int k = 0; k < 3; ++k) faces(k, f) = face[(k + turn) % 3];
  }
  return faces;
}

}  // namespace rilievo::testing
