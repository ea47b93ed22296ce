// Meshes and points with known distances between them.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/surface/measure_error.h"

namespace rilievo {

// In [-1, 1), of a counter (SplitMix64).
inline double CounterUnit(uint64_t counter) {
  uint64_t x = counter * 0x9e3779b97f4a7c15u + 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return static_cast<double>((x ^ (x >> 31)) >> 32) * 0x1p-31 - 1;
}

inline Eigen::Vector3d CounterPoint(uint64_t counter) {
  return {CounterUnit(3 * counter), CounterUnit(3 * counter + 1), CounterUnit(3 * counter + 2)};
}

// A sphere of rings x 2 rings quads, cut in two; vertices on the sphere.
inline Shape SphereShape(double radius, int rings, const Eigen::Vector3d& center) {
  Shape shape;
  const int columns = 2 * rings;
  shape.vertices.resize(3, (rings + 1) * (columns + 1));
  shape.triangles.resize(3, 2 * rings * columns);
  int f = 0;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j <= columns; ++j) {
      const double t = std::numbers::pi * i / rings, u = 2 * std::numbers::pi * j / columns;
      shape.vertices.col(i * (columns + 1) + j) =
          center + radius * Eigen::Vector3d(std::sin(t) * std::cos(u), std::sin(t) * std::sin(u),
                                            std::cos(t));
      if (i == rings || j == columns) continue;
      const int a = i * (columns + 1) + j, b = a + columns + 1;
      shape.triangles.col(f++) << a, b, b + 1;
      shape.triangles.col(f++) << a, b + 1, a + 1;
    }
  }
  return shape;
}

// The square [0, 1]^2 at height z, of size x size quads.
inline Shape SquareShape(double z, int size) {
  Shape shape;
  shape.vertices.resize(3, (size + 1) * (size + 1));
  shape.triangles.resize(3, 2 * size * size);
  int f = 0;
  for (int i = 0; i <= size; ++i) {
    for (int j = 0; j <= size; ++j) {
      shape.vertices.col(i * (size + 1) + j) << static_cast<double>(i) / size,
          static_cast<double>(j) / size, z;
      if (i == size || j == size) continue;
      const int a = i * (size + 1) + j, b = a + size + 1;
      shape.triangles.col(f++) << a, b, b + 1;
      shape.triangles.col(f++) << a, b + 1, a + 1;
    }
  }
  return shape;
}

}  // namespace rilievo
