#include "core/control/planar/planar_control_mesh.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/parallel_for_each.h"
#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/control/planar/harmonic_fill.h"
#include "core/control/planar/occupied_area.h"
#include "core/control/planar/plane_frame.h"
#include "core/control/planar/plane_lattice.h"
#include "core/control/planar/settings.h"
#include "core/control/planar/sheet_test.h"
#include "core/control/simplify/relax_mesh.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Points by square of the plane, for sums over a neighbourhood. Only squares with points take
// memory.
class PointBuckets {
 public:
  explicit PointBuckets(double width) : width_(width) {}

  absl::Status Fill(const Eigen::Matrix3Xd& points, const RunContext& context) {
    low_ = points.topRows<2>().rowwise().minCoeff();
    members_.resize(static_cast<size_t>(points.cols()));
    for (int i = 0; i < points.cols(); ++i) {
      const Vector2d at = (points.col(i).head<2>() - low_) / width_;
      members_[i] = {static_cast<int64_t>(at.y()), static_cast<int64_t>(at.x()), i};
    }
    return ParallelSort(std::less<>(), context, &members_);
  }

  // Calls visit(point) for the points of the squares within one width of `position`.
  template <typename Visit>
  void ForEachNear(const Vector2d& position, Visit visit) const {
    const Vector2d at = (position - low_) / width_;
    const auto column = static_cast<int64_t>(std::floor(at.x()));
    const auto row = static_cast<int64_t>(std::floor(at.y()));
    for (int64_t r = row - 1; r <= row + 1; ++r) {
      auto member =
          std::lower_bound(members_.begin(), members_.end(), std::tuple(r, column - 1, 0));
      for (; member != members_.end(); ++member) {
        const auto [of_row, of_column, point] = *member;
        if (of_row != r || of_column > column + 1) break;
        visit(point);
      }
    }
  }

 private:
  Vector2d low_ = Vector2d::Zero();
  double width_;
  std::vector<std::tuple<int64_t, int64_t, int>> members_;  // row, column, point; ascending
};

// Height at `position` of the plane fitted to the points within `reach`, nearer ones and those that
// stand for more area counting more. False where there are too few.
bool LocalHeight(const OrientedCloud& cloud, const Eigen::Matrix3Xd& plane_points,
                 const PointBuckets& buckets, const Vector2d& position, double reach,
                 double* height) {
  Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  int count = 0;
  buckets.ForEachNear(position, [&](int i) {
    const Vector2d offset = (plane_points.col(i).head<2>() - position) / reach;
    const double distance = offset.norm();
    if (distance >= 1) return;
    const double weight = PointArea(cloud, i) * (1 - distance) * (1 - distance);
    const Vector3d row(1, offset.x(), offset.y());
    gram += weight * row * row.transpose();
    right += weight * plane_points(2, i) * row;
    ++count;
  });
  if (count < kCommon.fewest_witnesses || !(gram(0, 0) > 0)) return false;
  // Points on one side or one line must not tilt the plane at will.
  const double hold = 0.02 * gram(0, 0);
  const double mean = right[0] / gram(0, 0);
  right -= mean * gram.col(0);
  gram(1, 1) += hold;
  gram(2, 2) += hold;
  *height = mean + gram.ldlt().solve(right)[0];
  return std::isfinite(*height);
}

absl::Status CheckServes(const OrientedCloud& cloud, const PlaneFrame& frame,
                         const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const HeightFieldCheck check, CheckHeightField(cloud, frame, context));
  if (check.single_sheet >= kSheetTest.least_single_sheet) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrFormat(
      "topology planar cannot serve: over %.0f %% of their plane the points lie on more than one "
      "sheet (at most %.0f %% can be borne); topology arbitrary would serve",
      100 * (1 - check.single_sheet), 100 * (1 - kSheetTest.least_single_sheet)));
}

}  // namespace

absl::StatusOr<ControlMesh> PlanarControlMesh(const OrientedCloud& cloud, BoundaryRule boundary,
                                              int target_faces, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  const PlaneFrame frame = FitPlaneFrame(cloud);
  RILIEVO_RETURN_IF_ERROR(CheckServes(cloud, frame, context));
  const Eigen::Matrix3Xd plane_points =
      frame.axes.transpose() * (cloud.points.colwise() - frame.origin);
  const double disc = kCommon.gap_spacings * cloud.median_spacing;
  RILIEVO_ASSIGN_OR_RETURN(
      OccupiedArea area,
      FindOccupiedArea(plane_points.topRows<2>(), cloud.spacing, cloud.median_spacing,
                       std::numbers::pi * disc * disc, boundary, context));
  const double face_area = area.area() / std::max(target_faces, 4);
  FillHoles(kPlanarControlMesh.hole_faces * face_area, boundary, &area);
  const double edge = std::sqrt(face_area * 4 / std::numbers::sqrt3);
  RILIEVO_ASSIGN_OR_RETURN(ControlMesh mesh, TriangulateArea(area, edge, context));
  if (mesh.faces.cols() == 0) {
    return absl::FailedPreconditionError(
        "topology planar cannot serve: the points cover no area of their plane that is wide enough "
        "for a control face; topology arbitrary would serve");
  }
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  context.Report(Stage::kControlMesh, 0.5);

  PointBuckets buckets(edge);
  RILIEVO_RETURN_IF_ERROR(buckets.Fill(plane_points, context));
  std::vector<uint8_t> known(static_cast<size_t>(mesh.vertices.cols()), 0);
  Eigen::VectorXd heights = Eigen::VectorXd::Zero(mesh.vertices.cols());
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(mesh.vertices.cols(), kHeavyBlock, context, [&](int64_t v) {
        known[v] = LocalHeight(cloud, plane_points, buckets, mesh.vertices.col(v).head<2>(), edge,
                               &heights[v])
                       ? 1
                       : 0;
      }));
  HarmonicFill(mesh.faces, known, &heights);
  mesh.vertices.row(2) = heights.transpose();
  mesh.vertices = ((frame.axes * mesh.vertices).colwise() + frame.origin).eval();
  return mesh;
}

}  // namespace rilievo
