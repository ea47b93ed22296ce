#include "core/booleans/trim_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/booleans/cut_loops.h"

namespace rilievo {
namespace {

TrimSide SideThrough(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d unit = normal.normalized();
  return {unit, unit.dot(point)};
}

absl::StatusOr<TrimBounds> Bounds(const Plane& plane) {
  const double length = plane.normal.norm();
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(plane.offset)) {
    return absl::InvalidArgumentError("plane: the normal must be finite and not zero");
  }
  return TrimBounds{{{plane.normal / length, plane.offset / length}}, {}, {}};
}

absl::StatusOr<TrimBounds> Bounds(const TrimBox& box) {
  if (!box.low.allFinite() || !box.high.allFinite() ||
      (box.low.array() >= box.high.array()).any()) {
    return absl::InvalidArgumentError(
        "box: two corners that differ in x, y and z are needed, all numbers finite");
  }
  TrimBounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = Eigen::Vector3d::Unit(axis);
    bounds.sides.push_back({normal, box.high[axis]});
    bounds.sides.push_back({-normal, -box.low[axis]});
  }
  return bounds;
}

absl::StatusOr<TrimBounds> Bounds(const TrimSphere& sphere) {
  if (!sphere.center.allFinite() || !(sphere.radius > 0) || !std::isfinite(sphere.radius)) {
    return absl::InvalidArgumentError(
        "sphere: the centre must be finite and the radius above zero");
  }
  return TrimBounds{{{sphere.center, 0, sphere.radius}}, {}, {}};
}

// The corners of a prism seen against its direction, and its ground plane.
struct FlatPrism {
  PlaneAxes axes;
  Eigen::Matrix2Xd corners;  // counter-clockwise
  std::vector<int> order;    // of the corners of the prism
};

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Whether the segments from a to b and from c to d have a point in common.
bool SegmentsMeet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                  const Eigen::Vector2d& d) {
  if ((a.cwiseMin(b).array() > c.cwiseMax(d).array()).any() ||
      (c.cwiseMin(d).array() > a.cwiseMax(b).array()).any()) {
    return false;
  }
  return Cross(b - a, c - a) * Cross(b - a, d - a) <= 0 &&
         Cross(d - c, a - c) * Cross(d - c, b - c) <= 0;
}

absl::StatusOr<FlatPrism> Flatten(const TrimPrism& prism) {
  const Eigen::Index count = prism.corners.cols();
  if (count < 3 || count > kMostPrismCorners) {
    return absl::InvalidArgumentError(absl::StrCat("polyline: it has ", count, " corners; 3 to ",
                                                   kMostPrismCorners, " are needed"));
  }
  const double length = prism.direction.norm();
  if (!prism.corners.allFinite() || !(length > 0) || !std::isfinite(length)) {
    return absl::InvalidArgumentError(
        "polyline: corners and direction must be finite, and the direction not zero");
  }
  FlatPrism flat{AxesOf({prism.direction / length, 0}), Eigen::Matrix2Xd(2, count),
                 std::vector<int>(static_cast<size_t>(count))};
  std::iota(flat.order.begin(), flat.order.end(), 0);
  Eigen::Matrix<double, 2, 3> to_plane;
  to_plane << flat.axes.right.transpose(), flat.axes.up.transpose();
  flat.corners = to_plane * prism.corners;
  double area = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    area += Cross(flat.corners.col(i) - flat.corners.col(0),
                  flat.corners.col((i + 1) % count) - flat.corners.col(0));
  }
  if (area < 0) {
    flat.corners = flat.corners.rowwise().reverse().eval();
    std::reverse(flat.order.begin(), flat.order.end());
  }
  const auto corner = [&](Eigen::Index i) -> Eigen::Vector2d {
    return flat.corners.col(i % count);
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = i + 1; j < count; ++j) {
      // Neighbours share a corner; they must not run back along each other.
      const bool next = j == i + 1, before = (j + 1) % count == i;
      const Eigen::Vector2d a = corner(i), b = corner(i + 1), c = corner(j), d = corner(j + 1);
      const auto back = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
        return Cross(u, v) == 0 && u.dot(v) <= 0;
      };
      if (next ? back(b - a, d - c) : before ? back(d - c, b - a) : SegmentsMeet(a, b, c, d)) {
        return absl::InvalidArgumentError(absl::StrCat(
            "polyline: seen along its direction, the lines from corners ",
            flat.order[static_cast<size_t>(i)] + 1, " and ", flat.order[static_cast<size_t>(j)] + 1,
            " meet; give a polyline that does not touch or cross itself"));
      }
    }
  }
  return flat;
}

std::vector<CutTriangle> TrianglesOf(const FlatPrism& flat) {
  std::vector<int> loop(static_cast<size_t>(flat.corners.cols()));
  std::iota(loop.begin(), loop.end(), 0);
  return CutLoops(flat.corners, {loop});
}

absl::StatusOr<TrimBounds> Bounds(const TrimPrism& prism) {
  RILIEVO_ASSIGN_OR_RETURN(const FlatPrism flat, Flatten(prism));
  TrimBounds bounds{{}, flat.corners, {}};
  bounds.to_outline << flat.axes.right.transpose(), flat.axes.up.transpose();
  for (Eigen::Index i = 0; i < flat.corners.cols(); ++i) {
    const Eigen::Vector2d from = flat.corners.col(i),
                          along = flat.corners.col((i + 1) % flat.corners.cols()) - from;
    bounds.sides.push_back(SideThrough(flat.axes.right * from.x() + flat.axes.up * from.y(),
                                       flat.axes.right * along.y() - flat.axes.up * along.x()));
  }
  return bounds;
}

// Axis-aligned box around the mesh, wider by its diagonal.
Eigen::AlignedBox3d Surroundings(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box(mesh.vertices.rowwise().minCoeff(), mesh.vertices.rowwise().maxCoeff());
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(box.diagonal().norm());
  return {box.min() - margin, box.max() + margin};
}

// Walls over the corners from `low` to `high` along the direction, and both ends.
TriangleMesh PrismMesh(const FlatPrism& flat, double low, double high) {
  const auto count = static_cast<int>(flat.corners.cols());
  const Eigen::Vector3d along = flat.axes.right.cross(flat.axes.up);
  TriangleMesh mesh;
  mesh.vertices.resize(3, 2 * count);
  std::vector<Eigen::Vector3i> triangles;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d ground =
        flat.axes.right * flat.corners(0, i) + flat.axes.up * flat.corners(1, i);
    mesh.vertices.col(i) = ground + low * along;
    mesh.vertices.col(count + i) = ground + high * along;
    const int next = (i + 1) % count;
    triangles.emplace_back(i, next, count + next);
    triangles.emplace_back(i, count + next, count + i);
  }
  for (const CutTriangle& t : TrianglesOf(flat)) {
    triangles.emplace_back(t.corners[0], t.corners[2], t.corners[1]);
    triangles.emplace_back(count + t.corners[0], count + t.corners[1], count + t.corners[2]);
  }
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t i = 0; i < triangles.size(); ++i) {
    mesh.triangles.col(static_cast<Eigen::Index>(i)) = triangles[i];
  }
  return mesh;
}

// How far the surroundings reach along a unit direction.
std::pair<double, double> RangeAlong(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& unit) {
  const double middle = unit.dot(box.center()), reach = box.diagonal().norm() / 2;
  return {middle - reach, middle + reach};
}

TriangleMesh SolidOf(const Plane& plane, const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d around = Surroundings(mesh);
  const double length = plane.normal.norm();
  const Plane unit{plane.normal / length, plane.offset / length};
  const PlaneAxes axes = AxesOf(unit);
  const auto [low, high] = RangeAlong(around, unit.normal);
  const double reach = around.diagonal().norm();
  Eigen::Matrix2Xd corners(2, 4);
  corners << -reach, reach, reach, -reach, -reach, -reach, reach, reach;
  corners.colwise() +=
      Eigen::Vector2d(axes.right.dot(around.center()), axes.up.dot(around.center()));
  // Something lies below even where the plane is below the mesh.
  return PrismMesh({axes, corners, {}}, std::min(low, unit.offset - reach), unit.offset);
}

TriangleMesh SolidOf(const TrimBox& box, const TriangleMesh&) {
  Eigen::Matrix2Xd corners(2, 4);
  corners << box.low.x(), box.high.x(), box.high.x(), box.low.x(), box.low.y(), box.low.y(),
      box.high.y(), box.high.y();
  return PrismMesh({{Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()}, corners, {}}, box.low.z(),
                   box.high.z());
}

TriangleMesh SolidOf(const TrimPrism& prism, const TriangleMesh& mesh) {
  const FlatPrism flat = *Flatten(prism);
  const auto [low, high] = RangeAlong(Surroundings(mesh), flat.axes.right.cross(flat.axes.up));
  return PrismMesh(flat, low, high);
}

// 524 288 triangles, within 4e-6 of the radius.
constexpr int kMostSphereLevels = 8;

// An octahedron, each triangle cut into four until its edges are short enough.
TriangleMesh SolidOf(const TrimSphere& sphere, const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> points;
  for (int axis = 0; axis < 3; ++axis) {
    points.push_back(Eigen::Vector3d::Unit(axis));
    points.push_back(-Eigen::Vector3d::Unit(axis));
  }
  std::vector<std::array<int, 3>> faces;
  for (int octant = 0; octant < 8; ++octant) {
    const int x = octant & 1, y = 2 + (octant >> 1 & 1), z = 4 + (octant >> 2);
    const bool turned = (x + y + z) % 2 != 0;
    faces.push_back({x, turned ? z : y, turned ? y : z});
  }
  const Eigen::Vector3d size =
      mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  const double longest = EdgeOnSphere(sphere.radius, size.norm()) / sphere.radius;
  double edge = std::sqrt(2.0);
  for (int level = 0; level < kMostSphereLevels && edge > longest; ++level, edge /= 2) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, made] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (made) {
        points.push_back(
            (points[static_cast<size_t>(a)] + points[static_cast<size_t>(b)]).normalized());
      }
      return at->second;
    };
    std::vector<std::array<int, 3>> finer;
    finer.reserve(4 * faces.size());
    for (const auto& [a, b, c] : faces) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  TriangleMesh solid;
  solid.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  for (size_t i = 0; i < points.size(); ++i) {
    solid.vertices.col(static_cast<Eigen::Index>(i)) = sphere.center + sphere.radius * points[i];
  }
  solid.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t i = 0; i < faces.size(); ++i) {
    solid.triangles.col(static_cast<Eigen::Index>(i)) = Eigen::Vector3i(faces[i].data());
  }
  return solid;
}

}  // namespace

double TrimSide::ValueAt(const Eigen::Vector3d& point) const {
  return radius > 0 ? (point - place).norm() - radius : place.dot(point) - offset;
}

Eigen::Vector3d TrimSide::Crossing(const Eigen::Vector3d& p, const Eigen::Vector3d& q) const {
  if (radius == 0) {
    const double at_p = ValueAt(p), at_q = ValueAt(q);
    return p + at_p / (at_p - at_q) * (q - p);
  }
  // |p - c + t (q - p)|^2 = r^2; the root between the ends, of which one is inside.
  const Eigen::Vector3d along = q - p, from = p - place;
  const double a = along.squaredNorm(), b = from.dot(along),
               c = (from.norm() - radius) * (from.norm() + radius),
               root = std::sqrt(std::max(0.0, b * b - a * c));
  const double t = c < 0 ? (root - b) / a : -(root + b) / a;
  return p + std::clamp(t, 0.0, 1.0) * along;
}

absl::StatusOr<TrimBounds> BoundsOf(const TrimShape& shape) {
  return std::visit([](const auto& s) { return Bounds(s); }, shape);
}

absl::StatusOr<TriangleMesh> SolidOfShape(const TrimShape& shape, const TriangleMesh& mesh) {
  RILIEVO_RETURN_IF_ERROR(BoundsOf(shape).status());
  return std::visit([&](const auto& s) { return SolidOf(s, mesh); }, shape);
}

double EdgeOnSphere(double radius, double diagonal) {
  // The sagitta of a chord e of a circle of radius r is e^2 / (8 r).
  return std::min(radius, std::sqrt(8 * radius * kTrimTolerance * diagonal));
}

}  // namespace rilievo
