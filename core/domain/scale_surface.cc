#include "core/domain/scale_surface.h"

#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_ring.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// Sum of weights times control points, less a target.
class WeightedSum final : public ceres::CostFunction {
 public:
  WeightedSum(std::vector<double> weights, Eigen::Vector3d target)
      : weights_(std::move(weights)), target_(std::move(target)) {
    set_num_residuals(3);
    mutable_parameter_block_sizes()->assign(weights_.size(), 3);
  }
  bool Evaluate(const double* const* points, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d> residual(residuals);
    residual = -target_;
    for (size_t i = 0; i < weights_.size(); ++i) {
      residual += weights_[i] * Eigen::Map<const Eigen::Vector3d>(points[i]);
      if (jacobians == nullptr || jacobians[i] == nullptr) continue;
      // Symmetric, so that the order of its rows does not matter.
      Eigen::Map<Eigen::Matrix3d> jacobian(jacobians[i]);
      jacobian = weights_[i] * Eigen::Matrix3d::Identity();
    }
    return true;
  }

 private:
  std::vector<double> weights_;
  Eigen::Vector3d target_;
};

class StopScaling final : public ceres::IterationCallback {
 public:
  explicit StopScaling(const RunContext& context) : context_(context) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return context_.CheckStop().ok() ? ceres::SOLVER_CONTINUE : ceres::SOLVER_ABORT;
  }

 private:
  const RunContext& context_;
};

struct BoxOfVertices {
  Eigen::Vector3d low, high;
  Eigen::Vector3d size() const { return high - low; }
};

absl::StatusOr<BoxOfVertices> BoxOf(const DisplacedSurface& surface, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const DisplacedVertices vertices, DisplaceVertices(surface, context));
  return BoxOfVertices{vertices.positions.rowwise().minCoeff(),
                       vertices.positions.rowwise().maxCoeff()};
}

bool Holds(const KeptFeature& feature, const Eigen::Vector3d& point) {
  const Eigen::Vector3d line = feature.to - feature.from, away = point - feature.from;
  const double along = away.dot(line) / line.squaredNorm();
  return along >= 0 && along <= 1 && (away - along * line).norm() <= feature.radius;
}

// By control point: the feature that it belongs to, or -1. `features`: unit frame.
absl::StatusOr<std::vector<int>> FindHeld(const DisplacedSurface& surface,
                                          const std::vector<KeptFeature>& features,
                                          const VertexRings& rings, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const DisplacedVertices vertices, DisplaceVertices(surface, context));
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(surface.control_mesh, surface.max_level, context));
  const Eigen::Matrix3Xi finest = FinestFaces(refinement);
  const Eigen::Matrix3Xi& faces = surface.control_mesh.faces;
  const Eigen::Index per_face = finest.cols() / faces.cols();
  std::vector<int> held(static_cast<size_t>(surface.control_mesh.vertices.cols()), -1);
  for (size_t i = 0; i < features.size(); ++i) {
    const auto hold = [&](int v) {
      int& by = held[static_cast<size_t>(v)];
      if (by >= 0 && by != static_cast<int>(i)) return false;
      by = static_cast<int>(i);
      return true;
    };
    bool any = false, alone = true;
    for (Eigen::Index f = 0; f < faces.cols(); ++f) {
      bool inside = false;
      for (Eigen::Index g = f * per_face; g < (f + 1) * per_face && !inside; ++g) {
        for (int k = 0; k < 3; ++k) {
          inside = inside || Holds(features[i], vertices.positions.col(finest(k, g)));
        }
      }
      if (!inside) continue;
      any = true;
      // The surface over a face depends on its corners and their neighbours.
      for (int k = 0; k < 3; ++k) {
        alone = hold(faces(k, f)) && alone;
        for (const int other : RingOf(rings, faces(k, f))) alone = hold(other) && alone;
      }
    }
    if (!any) {
      return absl::InvalidArgumentError(absl::StrCat(
          "feature ", i + 1, " holds no part of the surface; check its line and its radius"));
    }
    if (!alone) {
      return absl::FailedPreconditionError(
          absl::StrCat("feature ", i + 1,
                       " shares control points with another one; make one of both, or make the "
                       "surface with more control faces"));
    }
  }
  return held;
}

absl::Status CheckScaling(const Eigen::Vector3d& size, const std::vector<KeptFeature>& features) {
  if (!size.allFinite() || (size.array() <= 0).any()) {
    return absl::InvalidArgumentError("size: three lengths above zero are needed");
  }
  for (size_t i = 0; i < features.size(); ++i) {
    const KeptFeature& feature = features[i];
    if (feature.from.allFinite() && feature.to.allFinite() && feature.from != feature.to &&
        feature.radius > 0 && std::isfinite(feature.radius)) {
      continue;
    }
    return absl::InvalidArgumentError(absl::StrCat(
        "feature ", i + 1, ": two different places and a radius above zero are needed"));
  }
  return absl::OkStatus();
}

// Control points of least squares against those of the scaled control mesh, with some held.
absl::StatusOr<Eigen::Matrix3Xd> SolveScaled(const Eigen::Matrix3Xd& scaled,
                                             const Eigen::Matrix3Xd& start,
                                             const std::vector<int>& held, const VertexRings& rings,
                                             const RunContext& context) {
  Eigen::Matrix3Xd points = start;
  ceres::Problem problem;
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    const std::span<const int> ring = RingOf(rings, static_cast<int>(v));
    std::vector<double> weights = {-1};
    std::vector<double*> blocks = {points.col(v).data()};
    Eigen::Vector3d target = -scaled.col(v);
    for (const int neighbor : ring) {
      weights.push_back(1.0 / static_cast<double>(ring.size()));
      blocks.push_back(points.col(neighbor).data());
      target += weights.back() * scaled.col(neighbor);
    }
    problem.AddResidualBlock(new WeightedSum(weights, target), nullptr, blocks);
    problem.AddResidualBlock(new WeightedSum({kScaleSurface.position_weight},
                                             kScaleSurface.position_weight * scaled.col(v)),
                             nullptr, points.col(v).data());
  }
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    if (held[static_cast<size_t>(v)] >= 0) problem.SetParameterBlockConstant(points.col(v).data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  // The problem is linear: steps are those of Gauss and Newton, and the first one is the last.
  options.initial_trust_region_radius = 1e16;
  options.function_tolerance = 1e-16;
  options.gradient_tolerance = 1e-14;
  StopScaling stop(context);
  options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (!summary.IsSolutionUsable()) {
    return absl::InternalError(absl::StrCat("constrained scaling: ", summary.message));
  }
  return points;
}

}  // namespace

absl::StatusOr<ScaledSurface> ScaleSurface(const DisplacedSurface& surface,
                                           const Eigen::Vector3d& size,
                                           const std::vector<KeptFeature>& features,
                                           const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckScaling(size, features));
  const SpatialFrame& frame = surface.frame;
  std::vector<KeptFeature> in_unit = features;
  for (KeptFeature& feature : in_unit) {
    feature = {frame.UnitFromScan(feature.from), frame.UnitFromScan(feature.to),
               feature.radius / frame.diagonal};
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const MeshTopology topology,
      BuildMeshTopology(surface.control_mesh.faces,
                        static_cast<int>(surface.control_mesh.vertices.cols())));
  const VertexRings rings = BuildVertexRings(topology);
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> held, FindHeld(surface, in_unit, rings, context));
  RILIEVO_ASSIGN_OR_RETURN(const BoxOfVertices before, BoxOf(surface, context));
  if ((before.size().array() <= 0).any()) {
    return absl::FailedPreconditionError("the surface is flat along an axis; nothing scales that");
  }
  const Eigen::Vector3d middle = (before.low + before.high) / 2, wanted = size / frame.diagonal;
  Eigen::Vector3d factors = wanted.cwiseQuotient(before.size());
  for (int axis = 0; axis < 3; ++axis) {
    if (factors[axis] >= 1 / kScaleSurface.most_scaling &&
        factors[axis] <= kScaleSurface.most_scaling)
      continue;
    return absl::InvalidArgumentError(
        absl::StrCat("size: along ", std::string(1, "xyz"[axis]), " the box is ",
                     frame.diagonal * before.size()[axis], ", which cannot become ", size[axis],
                     "; lengths from a ", kScaleSurface.most_scaling, "th of it to ",
                     kScaleSurface.most_scaling, " times it are allowed"));
  }
  const Eigen::Matrix3Xd& given = surface.control_mesh.vertices;
  DisplacedSurface scaled = surface;
  ScaledSurface result;
  result.size_before = frame.diagonal * before.size();
  result.held =
      static_cast<int>(std::count_if(held.begin(), held.end(), [](int i) { return i >= 0; }));
  for (;;) {
    const auto scale = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
      return middle + factors.cwiseProduct(p - middle);
    };
    Eigen::Matrix3Xd target(3, given.cols()), start(3, given.cols());
    for (Eigen::Index v = 0; v < given.cols(); ++v) {
      target.col(v) = start.col(v) = scale(given.col(v));
      const int feature = held[static_cast<size_t>(v)];
      if (feature < 0) continue;
      const KeptFeature& kept = in_unit[static_cast<size_t>(feature)];
      const Eigen::Vector3d center = (kept.from + kept.to) / 2;
      start.col(v) = given.col(v) + scale(center) - center;
    }
    RILIEVO_ASSIGN_OR_RETURN(scaled.control_mesh.vertices,
                             SolveScaled(target, start, held, rings, context));
    ++result.rounds;
    RILIEVO_ASSIGN_OR_RETURN(const BoxOfVertices box, BoxOf(scaled, context));
    result.size = frame.diagonal * box.size();
    if ((box.size() - wanted).cwiseAbs().maxCoeff() <= kScaleSurface.box_tolerance) break;
    if (result.rounds == kScaleSurface.most_rounds) {
      Eigen::Index axis = 0;
      (box.size() - wanted).cwiseAbs().maxCoeff(&axis);
      return absl::FailedPreconditionError(absl::StrCat(
          "along ", std::string(1, "xyz"[axis]), " the box comes to ", result.size[axis],
          " and not to ", size[axis],
          result.held > 0 ? ": kept features reach its sides, or beyond; keep less of them"
                          : ": the heights, which keep their size, reach beyond; ask for more"));
    }
    factors = factors.cwiseProduct(wanted.cwiseQuotient(box.size()));
  }
  result.cage = scaled.control_mesh;
  result.cage.vertices = (scaled.control_mesh.vertices * frame.diagonal).colwise() + frame.center;
  return result;
}

}  // namespace rilievo
