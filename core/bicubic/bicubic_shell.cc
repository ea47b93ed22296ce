#include "core/bicubic/bicubic_shell.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/bicubic/cubic_spline.h"
#include "core/bicubic/patch_domains.h"
#include "core/evaluate/displaced_evaluator.h"

namespace rilievo {
namespace {

using Eigen::MatrixXd;

// The part of the tolerance that is an edge's; what it is off adds to what the patches are.
constexpr double kEdgeShare = 0.25;
// Samples along a side: for each triangle of the finest level, for each span, and at least.
constexpr int kSamplesPerTriangle = 4, kSamplesPerSpan = 4, kFewestSamples = 12;
// Along edges of the finest level the relief bends sharply, and at irregular vertices the limit
// surface does: splines come to that as their spans become shorter.
constexpr int kMostSpans = 128;

// Splines of 1, 2, 4, ... kMostSpans spans, with the places that samples are needed at.
class SplineFamily {
 public:
  // `triangles`: along a side.
  explicit SplineFamily(int triangles) {
    for (int spans = 1; spans <= kMostSpans; spans *= 2) {
      splines_.emplace_back(spans, std::max({kFewestSamples, kSamplesPerTriangle * triangles,
                                             kSamplesPerSpan * spans}));
    }
  }

  size_t finest() const { return splines_.size() - 1; }
  const CubicSpline& operator[](size_t k) const { return splines_[k]; }

  // The curve of spline `coarse` in control points of spline `fine`, which hold it exactly.
  Eigen::Matrix3Xd Refined(const Eigen::Matrix3Xd& control, size_t coarse, size_t fine) const {
    if (coarse == fine) return control;
    const auto basis = BasisOfSpans(splines_[coarse].spans(), splines_[fine].intervals());
    return splines_[fine].FitCurve(control * basis.transpose());
  }

 private:
  std::vector<CubicSpline> splines_;
};

class ShellFit {
 public:
  ShellFit(const PatchDomains& domains, const DisplacedEvaluator& surface, int triangles,
           const BicubicOptions& options)
      : domains_(domains),
        surface_(surface),
        tolerance_(options.tolerance),
        most_control_points_(options.most_control_points),
        splines_(triangles) {}

  absl::StatusOr<BicubicShell> Run(const RunContext& context) {
    shell_.vertices.resize(3, domains_.vertex_count);
    shell_.edges.resize(domains_.edges.size());
    shell_.patches.resize(domains_.patches.size());
    fineness_.resize(domains_.edges.size());
    std::vector<double> errors(domains_.edges.size() + domains_.patches.size());
    for (const DomainEdge& edge : domains_.edges) {
      shell_.vertices.col(edge.from) = PointAt(edge.At(0));
      shell_.vertices.col(edge.to) = PointAt(edge.At(1));
    }
    const auto count = [](const auto& list) { return static_cast<int64_t>(list.size()); };
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count(domains_.edges), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          for (auto e = static_cast<size_t>(begin); e < static_cast<size_t>(end); ++e) {
            errors[e] = FitEdge(e);
          }
        }));
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count(domains_.patches), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          for (auto p = static_cast<size_t>(begin); p < static_cast<size_t>(end); ++p) {
            if (control_points_ > most_control_points_) return;
            errors[domains_.edges.size() + p] = FitPatch(p);
            control_points_ += shell_.patches[p].control.cols();
          }
        }));
    if (control_points_ > most_control_points_) {
      return absl::ResourceExhaustedError(absl::StrCat(
          "patches within the tolerance of ", tolerance_, " of the diagonal need more than ",
          most_control_points_, " control points; a larger tolerance needs fewer"));
    }
    // A mesh has faces, else DomainsOf() refuses it.
    shell_.error = *std::max_element(errors.begin(), errors.end());
    return std::move(shell_);
  }

 private:
  using Grid = std::array<MatrixXd, 3>;  // x, y and z, a row for each s, a column for each t

  // Unit frame.
  Eigen::Vector3d PointAt(const FacePlace& place) const {
    return surface_.UnitAt(place.face, place.weights[1], place.weights[2], JetOrder::kPosition)
        .position;
  }

  // Returns the error.
  double FitEdge(size_t e) {
    const DomainEdge& domain = domains_.edges[e];
    BicubicShell::Edge& edge = shell_.edges[e];
    edge.from = domain.from;
    edge.to = domain.to;
    Eigen::Matrix3Xd points;
    for (size_t k = 0;; ++k) {
      const int intervals = splines_[k].intervals();
      if (points.cols() != intervals + 1) {
        points.resize(3, intervals + 1);
        for (int i = 1; i < intervals; ++i) {
          points.col(i) = PointAt(domain.At(static_cast<double>(i) / intervals));
        }
        points.col(0) = shell_.vertices.col(domain.from);
        points.col(intervals) = shell_.vertices.col(domain.to);
      }
      edge.control = splines_[k].FitCurve(points);
      fineness_[e] = k;
      const double error =
          (edge.control * splines_[k].basis().transpose() - points).colwise().norm().maxCoeff();
      if (error <= kEdgeShare * tolerance_ || k == splines_.finest()) return error;
    }
  }

  // The curve of edge i of a patch in control points of spline k, from s or t = 0 to 1.
  Eigen::Matrix3Xd SideOf(const DomainPatch& patch, size_t i, size_t k) const {
    const auto e = static_cast<size_t>(patch.edges[i]);
    const Eigen::Matrix3Xd control = splines_.Refined(shell_.edges[e].control, fineness_[e], k);
    // Edges 2 and 3 run against s and t.
    return patch.forward[i] == (i < 2) ? control : control.rowwise().reverse().eval();
  }

  Grid PointsOf(const DomainPatch& domain, int along_s, int along_t) const {
    Grid points;
    for (MatrixXd& axis : points) axis.resize(along_s + 1, along_t + 1);
    for (int j = 0; j <= along_t; ++j) {
      for (int i = 0; i <= along_s; ++i) {
        const Eigen::Vector3d point =
            PointAt(domain.At(static_cast<double>(i) / along_s, static_cast<double>(j) / along_t));
        for (size_t axis = 0; axis < 3; ++axis) {
          points[axis](i, j) = point[static_cast<Eigen::Index>(axis)];
        }
      }
    }
    return points;
  }

  static MatrixXd Evaluated(const CubicSpline& along_s, const CubicSpline& along_t,
                            const MatrixXd& control) {
    const MatrixXd by_s = along_s.basis() * control;
    return by_s * along_t.basis().transpose();
  }

  // Returns the error. `control` has the right size.
  static double FitInside(const CubicSpline& along_s, const CubicSpline& along_t,
                          const Grid& points, const std::array<Eigen::Matrix3Xd, 4>& sides,
                          Grid* control) {
    const Eigen::Index rows = along_s.control_count(), columns = along_t.control_count();
    Eigen::ArrayXXd squared = Eigen::ArrayXXd::Zero(points[0].rows(), points[0].cols());
    for (int axis = 0; axis < 3; ++axis) {
      MatrixXd& grid = (*control)[static_cast<size_t>(axis)];
      const MatrixXd& samples = points[static_cast<size_t>(axis)];
      grid = MatrixXd::Zero(rows, columns);
      grid.row(0) = sides[3].row(axis);
      grid.row(rows - 1) = sides[1].row(axis);
      grid.col(0) = sides[0].row(axis).transpose();
      grid.col(columns - 1) = sides[2].row(axis).transpose();
      const MatrixXd rest = samples - Evaluated(along_s, along_t, grid);
      grid.block(1, 1, rows - 2, columns - 2) =
          along_t.FitInside(along_s.FitInside(rest).transpose()).transpose();
      squared += (Evaluated(along_s, along_t, grid) - samples).array().square();
    }
    return std::sqrt(squared.maxCoeff());
  }

  // Returns the error.
  double FitPatch(size_t p) {
    const DomainPatch& domain = domains_.patches[p];
    const auto fineness = [&](size_t i) { return fineness_[static_cast<size_t>(domain.edges[i])]; };
    size_t k = std::max(fineness(0), fineness(2)), l = std::max(fineness(1), fineness(3));
    Grid control, points;
    double error;
    while (true) {
      const CubicSpline &along_s = splines_[k], &along_t = splines_[l];
      if (points[0].rows() != along_s.intervals() + 1 ||
          points[0].cols() != along_t.intervals() + 1) {
        points = PointsOf(domain, along_s.intervals(), along_t.intervals());
      }
      std::array<Eigen::Matrix3Xd, 4> sides;
      for (size_t i = 0; i < 4; ++i) sides[i] = SideOf(domain, i, i % 2 == 0 ? k : l);
      error = FitInside(along_s, along_t, points, sides, &control);
      if (error <= tolerance_ || (k == splines_.finest() && l == splines_.finest())) break;
      const bool both = k == l;
      if (both || k < l) ++k;
      if (both || l < k) ++l;
    }
    BicubicShell::Patch& patch = shell_.patches[p];
    patch.edges = domain.edges;
    patch.forward = domain.forward;
    patch.spans = {splines_[k].spans(), splines_[l].spans()};
    patch.control.resize(3, control[0].size());
    for (int axis = 0; axis < 3; ++axis) {
      patch.control.row(axis) =
          control[static_cast<size_t>(axis)].reshaped<Eigen::ColMajor>().transpose();
    }
    return error;
  }

  const PatchDomains& domains_;
  const DisplacedEvaluator& surface_;
  const double tolerance_;
  const int64_t most_control_points_;
  const SplineFamily splines_;
  std::vector<size_t> fineness_;             // of each edge: place in splines_
  std::atomic<int64_t> control_points_ = 0;  // of the patches so far
  BicubicShell shell_;
};

void MoveToScanFrame(const SpatialFrame& frame, Eigen::Matrix3Xd& points) {
  for (auto point : points.colwise()) point = frame.ScanFromUnit(point);
}

}  // namespace

absl::Status BicubicOptions::Validate() const {
  if (tolerance > 0 && tolerance < 1) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("tolerance is ", tolerance, ", must lie between 0 and 1, both excluded"));
}

absl::StatusOr<BicubicShell> FitBicubicShell(const DisplacedSurface& surface,
                                             const BicubicOptions& options,
                                             const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_ASSIGN_OR_RETURN(const PatchDomains domains, DomainsOf(surface.control_mesh));
  if (static_cast<int64_t>(domains.patches.size()) > kMostBicubicPatches) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "the control mesh has ", surface.control_mesh.faces.cols(), " faces, which make ",
        domains.patches.size(), " patches; at most ", kMostBicubicPatches,
        " can be made. A surface made with fewer control faces has fewer"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const DisplacedEvaluator evaluator,
                           DisplacedEvaluator::Build(surface, context));
  // Patches of triangles have half an edge along a side.
  const int triangles =
      std::max(1, evaluator.triangles_along_side() / (surface.control_mesh.quads() ? 1 : 2));
  ShellFit fit(domains, evaluator, triangles, options);
  RILIEVO_ASSIGN_OR_RETURN(BicubicShell shell, fit.Run(context));
  MoveToScanFrame(surface.frame, shell.vertices);
  for (BicubicShell::Edge& edge : shell.edges) MoveToScanFrame(surface.frame, edge.control);
  for (BicubicShell::Patch& patch : shell.patches) MoveToScanFrame(surface.frame, patch.control);
  return shell;
}

}  // namespace rilievo
