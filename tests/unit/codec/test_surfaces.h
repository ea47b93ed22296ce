// Surfaces that the codec's tests encode: every kind of topology, heights of every kind.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/loop/refinement.h"
#include "core/surface/displaced_surface.h"
#include "gtest/gtest.h"

namespace rilievo {

inline ControlMesh Octahedron() {
  ControlMesh mesh;
  mesh.vertices.resize(3, 6);
  mesh.vertices << 0.4, -0.4, 0, 0, 0, 0,  //
      0, 0, 0.4, -0.4, 0, 0,               //
      0, 0, 0, 0, 0.4, -0.4;
  mesh.faces.resize(3, 8);
  mesh.faces << 0, 2, 1, 3, 2, 1, 3, 0,  //
      2, 1, 3, 0, 0, 2, 1, 3,            //
      4, 4, 4, 4, 5, 5, 5, 5;
  return mesh;
}

// A torus of rows x columns quads, each cut in two.
inline ControlMesh Torus(int rows, int columns) {
  ControlMesh mesh;
  mesh.vertices.resize(3, rows * columns);
  mesh.faces.resize(3, 2 * rows * columns);
  int face = 0;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double u = 2 * std::numbers::pi * i / rows, v = 2 * std::numbers::pi * j / columns;
      const double radius = 0.3 + 0.12 * std::cos(v);
      mesh.vertices.col(i * columns + j) << radius * std::cos(u), radius * std::sin(u),
          0.12 * std::sin(v);
      const int i1 = (i + 1) % rows, j1 = (j + 1) % columns;
      const int a = i * columns + j, b = i1 * columns + j, c = i1 * columns + j1,
                d = i * columns + j1;
      mesh.faces.col(face++) << a, b, c;
      mesh.faces.col(face++) << a, c, d;
    }
  }
  return mesh;
}

// A wavy sheet of rows x columns vertices; with `hole`, the quads in the middle are left out.
inline ControlMesh Sheet(int rows, int columns, bool hole) {
  ControlMesh mesh;
  mesh.vertices.resize(3, rows * columns);
  std::vector<Eigen::Vector3i> faces;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double x = 0.7 * i / (rows - 1) - 0.35, y = 0.7 * j / (columns - 1) - 0.35;
      mesh.vertices.col(i * columns + j) << x, y, 0.05 * std::sin(9 * x) * std::cos(7 * y);
      if (i + 1 == rows || j + 1 == columns) continue;
      if (hole && i == rows / 2 && j == columns / 2) continue;
      const int a = i * columns + j, b = a + columns;
      faces.push_back({a, b, b + 1});
      faces.push_back({a, b + 1, a + 1});
    }
  }
  mesh.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.col(static_cast<Eigen::Index>(f)) = faces[f];
  return mesh;
}

// Both meshes as one, the second moved by `offset`.
inline ControlMesh Together(const ControlMesh& a, const ControlMesh& b,
                            const Eigen::Vector3d& offset) {
  ControlMesh mesh;
  mesh.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  mesh.vertices << a.vertices, b.vertices.colwise() + offset;
  mesh.faces.resize(3, a.faces.cols() + b.faces.cols());
  mesh.faces << a.faces, (b.faces.array() + static_cast<int>(a.vertices.cols())).matrix();
  return mesh;
}

// The quads that Torus() and Sheet() cut in two; if `creased`, every fifth has a crease.
inline ControlMesh InQuadsOf(ControlMesh mesh, bool creased) {
  for (Eigen::Index f = 0; f < mesh.faces.cols(); f += 2) {
    mesh.diagonals.push_back({std::min(mesh.faces(0, f), mesh.faces(2, f)),
                              std::max(mesh.faces(0, f), mesh.faces(2, f))});
    if (!creased || f % 10 != 0) continue;
    mesh.creases.push_back({std::min(mesh.faces(0, f), mesh.faces(1, f)),
                            std::max(mesh.faces(0, f), mesh.faces(1, f)), 1.5f});
  }
  std::sort(mesh.diagonals.begin(), mesh.diagonals.end());
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& x, const Crease& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
  return mesh;
}

// 32 well-mixed bits of a counter (SplitMix64).
inline uint32_t MixedBits(uint64_t counter) {
  uint64_t x = counter * 0x9e3779b97f4a7c15u + 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return static_cast<uint32_t>((x ^ (x >> 31)) >> 32);
}

// Uniform in [-1, 1).
inline double MixedUnit(uint64_t counter) { return MixedBits(counter) * 0x1p-31 - 1; }

// The same mesh with faces of all sizes: each vertex nearer to the origin or farther from it, by a
// factor of up to `unevenness`.
inline ControlMesh Uneven(ControlMesh mesh, double unevenness) {
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices.col(v) *= std::pow(unevenness, MixedUnit(static_cast<uint64_t>(v)));
  }
  return mesh;
}

// The same mesh with vertices and faces in another order and faces turned.
inline ControlMesh Shuffled(const ControlMesh& mesh, uint64_t seed) {
  const auto shuffle = [seed](int count, uint64_t stream) {
    std::vector<int> order(count);
    for (int i = 0; i < count; ++i) {
      order[i] = i;
      std::swap(order[i], order[MixedBits(seed + 7919 * stream + i) % (i + 1)]);
    }
    return order;
  };
  const std::vector<int> vertices = shuffle(static_cast<int>(mesh.vertices.cols()), 1);
  const std::vector<int> faces = shuffle(static_cast<int>(mesh.faces.cols()), 2);
  ControlMesh result = mesh;
  for (size_t v = 0; v < vertices.size(); ++v) {
    result.vertices.col(vertices[v]) = mesh.vertices.col(static_cast<Eigen::Index>(v));
  }
  for (size_t f = 0; f < faces.size(); ++f) {
    const int turn = static_cast<int>(MixedBits(seed + f) % 3);
    for (int k = 0; k < 3; ++k) {
      result.faces(k, faces[f]) =
          vertices[mesh.faces((k + turn) % 3, static_cast<Eigen::Index>(f))];
    }
  }
  return result;
}

// Smooth heights with `noise` (fraction of the diagonal) over the prepared mesh.
inline DisplacedSurface SurfaceOver(const ControlMesh& mesh, int max_level, double position_step,
                                    double noise) {
  DisplacedSurface surface;
  surface.frame.center = {512345.25, 4612345.5, 210.75};
  surface.frame.diagonal = 123.456;
  surface.control_mesh = *PrepareControlMesh(mesh, position_step);
  surface.max_level = max_level;
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, max_level, RunContext());
  const LimitSurface limit =
      *EvaluateLimit(refinement, surface.control_mesh.vertices, max_level, RunContext());
  for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
    const Eigen::Vector3d p = limit.positions.col(v);
    const double smooth = 0.01 * std::sin(11 * p[0]) * std::cos(8 * p[1] + 5 * p[2]);
    const double bump = noise * (MixedUnit(3 * v) + MixedUnit(3 * v + 1));
    surface.heights.push_back(static_cast<float>(smooth + bump));
    const bool filled = p[0] > 0.2 && p[1] > 0;
    const bool smoothed = p[1] < -0.05 || MixedBits(3 * v + 2) % 64 == 0;
    surface.sources.push_back(filled     ? HeightSource::kFilled
                              : smoothed ? HeightSource::kSmoothed
                                         : HeightSource::kMeasured);
  }
  return surface;
}

}  // namespace rilievo
