#include "tests/scans/scene_builder.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace rilievo {

using Eigen::Vector3d;

int SceneBuilder::Steps(double length) const {
  return std::max(1, static_cast<int>(std::lround(length / cell_)));
}

void SceneBuilder::AddFace(const Vector3d& corner, const Vector3d& u, const Vector3d& v) {
  AddGrid(u.norm(), v.norm(),
          [&](double s, double t) -> Vector3d { return corner + s * u + t * v; });
}

void SceneBuilder::AddFacade(const Vector3d& foot, const Vector3d& u, double height,
                             const std::vector<Window>& windows, double depth) {
  const double length = u.norm();
  const Vector3d along = u / length, up = Vector3d::UnitZ();
  const Vector3d inward = -depth * along.cross(up);
  const auto at = [&](double s, double t) -> Vector3d { return foot + s * along + t * up; };
  std::vector<double> across{0, length}, above{0, height};
  for (const Window& window : windows) {
    across.insert(across.end(), {window.left, window.right});
    above.insert(above.end(), {window.bottom, window.top});
  }
  for (std::vector<double>* lines : {&across, &above}) {
    std::sort(lines->begin(), lines->end());
    lines->erase(std::unique(lines->begin(), lines->end()), lines->end());
  }
  for (size_t i = 0; i + 1 < across.size(); ++i) {
    for (size_t j = 0; j + 1 < above.size(); ++j) {
      const double s = (across[i] + across[i + 1]) / 2, t = (above[j] + above[j + 1]) / 2;
      const bool open = std::any_of(windows.begin(), windows.end(), [&](const Window& window) {
        return s > window.left && s < window.right && t > window.bottom && t < window.top;
      });
      if (open) continue;
      AddFace(at(across[i], above[j]), (across[i + 1] - across[i]) * along,
              (above[j + 1] - above[j]) * up);
    }
  }
  if (depth == 0) return;
  for (const Window& window : windows) {
    const Vector3d wide = (window.right - window.left) * along;
    const Vector3d tall = (window.top - window.bottom) * up;
    AddFace(at(window.left, window.bottom) + inward, wide, tall);
    AddFace(at(window.left, window.bottom), wide, inward);             // sill
    AddFace(at(window.left, window.top) + inward, wide, -inward);      // lintel
    AddFace(at(window.left, window.bottom), inward, tall);             // left reveal
    AddFace(at(window.right, window.bottom) + inward, -inward, tall);  // right reveal
  }
}

void SceneBuilder::AddBox(const Vector3d& low, const Vector3d& high) {
  const Vector3d size = high - low;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d u = size[(axis + 1) % 3] * Vector3d::Unit((axis + 1) % 3);
    const Vector3d v = size[(axis + 2) % 3] * Vector3d::Unit((axis + 2) % 3);
    AddFace(low, v, u);
    AddFace(low + size[axis] * Vector3d::Unit(axis), u, v);
  }
}

void SceneBuilder::AddPost(const Vector3d& foot, double radius, double height, int sides) {
  const Vector3d top = foot + height * Vector3d::UnitZ();
  const auto rim = [&](int k) -> Vector3d {
    const double angle = 2 * std::numbers::pi * k / sides;
    return radius * Vector3d(std::cos(angle), std::sin(angle), 0);
  };
  for (int k = 0; k < sides; ++k) {
    AddFace(foot + rim(k), rim(k + 1) - rim(k), height * Vector3d::UnitZ());
    AddTriangle(top, top + rim(k), top + rim(k + 1));
  }
}

void SceneBuilder::AddTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const int steps = Steps(std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}));
  const int first = static_cast<int>(vertices_.size());
  const auto index = [first](int row, int column) { return first + row * (row + 1) / 2 + column; };
  for (int row = 0; row <= steps; ++row) {
    for (int column = 0; column <= row; ++column) {
      vertices_.push_back(a + (b - a) * (row - column) / steps + (c - a) * column / steps);
    }
  }
  for (int row = 0; row < steps; ++row) {
    for (int column = 0; column <= row; ++column) {
      triangles_.push_back(
          {index(row, column), index(row + 1, column), index(row + 1, column + 1)});
      if (column == row) continue;
      triangles_.push_back(
          {index(row, column), index(row + 1, column + 1), index(row, column + 1)});
    }
  }
}

TriangleMesh SceneBuilder::Take() {
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
  for (size_t v = 0; v < vertices_.size(); ++v) mesh.vertices.col(v) = vertices_[v];
  for (size_t f = 0; f < triangles_.size(); ++f) mesh.triangles.col(f) = triangles_[f];
  vertices_.clear();
  triangles_.clear();
  return mesh;
}

}  // namespace rilievo
