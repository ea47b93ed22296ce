// Flat faces, cut into small triangles, of which scenes are built.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// A rectangle in the coordinates of a facade: along its length and above its foot.
struct Window {
  double left, right, bottom, top;
};

class SceneBuilder {
 public:
  // `cell`: about the longest edge of the triangles along a face's sides.
  explicit SceneBuilder(double cell) : cell_(cell) {}

  // The parallelogram at `corner`; its outside is where u x v points.
  void AddFace(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v);

  // A vertical face from `foot` along `u`, `height` tall, with windows that are recessed by `depth`
  // (0: open). Its outside is where u x z points.
  void AddFacade(const Eigen::Vector3d& foot, const Eigen::Vector3d& u, double height,
                 const std::vector<Window>& windows, double depth);

  // All six faces of a box.
  void AddBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

  // A prism of `sides` faces that stands on `foot`, with a lid.
  void AddPost(const Eigen::Vector3d& foot, double radius, double height, int sides);

  // A triangle, cut as faces are.
  void AddTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

  // z = height(x, y) over the rectangle from `low` to `high`.
  template <typename Height>
  void AddGround(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const Height& height) {
    AddGrid(high.x() - low.x(), high.y() - low.y(), [&](double s, double t) {
      const Eigen::Vector2d p = low + (high - low).cwiseProduct(Eigen::Vector2d(s, t));
      return Eigen::Vector3d(p.x(), p.y(), height(p.x(), p.y()));
    });
  }

  TriangleMesh Take();

 private:
  int Steps(double length) const;

  // `place`: from [0, 1]^2, whose sides are so long.
  template <typename Place>
  void AddGrid(double width, double height, const Place& place) {
    const int columns = Steps(width), rows = Steps(height);
    const int first = static_cast<int>(vertices_.size());
    for (int row = 0; row <= rows; ++row) {
      for (int column = 0; column <= columns; ++column) {
        vertices_.push_back(
            place(static_cast<double>(column) / columns, static_cast<double>(row) / rows));
      }
    }
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const int a = first + row * (columns + 1) + column, b = a + 1;
        const int c = b + columns + 1, d = a + columns + 1;
        triangles_.push_back({a, b, c});
        triangles_.push_back({a, c, d});
      }
    }
  }

  double cell_;
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace rilievo
