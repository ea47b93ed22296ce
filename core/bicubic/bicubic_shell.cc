#include "core/bicubic/bicubic_shell.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/bicubic/cubic_spline.h"
#include "core/bicubic/patch_domains.h"
#include "core/bicubic/surface_lattice.h"

namespace rilievo {
namespace {

using Eigen::MatrixXd;

// The part of the tolerance that is an edge's; what it is off adds to what the patches are.
constexpr double kEdgeShare = 0.5;

class ShellFit {
 public:
  ShellFit(const PatchDomains& domains, const SurfaceLattice& lattice, int intervals,
           double tolerance)
      : domains_(domains), lattice_(lattice), intervals_(intervals), tolerance_(tolerance) {
    // More samples than control points.
    for (int spans = 1; spans + 3 <= intervals; spans *= 2) splines_.emplace_back(spans, intervals);
  }

  absl::StatusOr<BicubicShell> Run(const RunContext& context) {
    shell_.vertices.resize(3, domains_.vertex_count);
    shell_.edges.resize(domains_.edges.size());
    shell_.patches.resize(domains_.patches.size());
    fineness_.resize(domains_.edges.size());
    std::vector<double> errors(domains_.edges.size() + domains_.patches.size());
    PlaceSampler vertices(lattice_);
    for (const DomainEdge& edge : domains_.edges) {
      shell_.vertices.col(edge.from) = vertices.At(edge.At(0));
      shell_.vertices.col(edge.to) = vertices.At(edge.At(1));
    }
    const auto count = [](const auto& list) { return static_cast<int64_t>(list.size()); };
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count(domains_.edges), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          PlaceSampler samples(lattice_);
          for (auto e = static_cast<size_t>(begin); e < static_cast<size_t>(end); ++e) {
            errors[e] = FitEdge(e, samples);
          }
        }));
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count(domains_.patches), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          PlaceSampler samples(lattice_);
          for (auto p = static_cast<size_t>(begin); p < static_cast<size_t>(end); ++p) {
            errors[domains_.edges.size() + p] = FitPatch(p, samples);
          }
        }));
    shell_.error = *std::max_element(errors.begin(), errors.end());
    return std::move(shell_);
  }

 private:
  using Grid = std::array<MatrixXd, 3>;  // x, y and z, a row for each s, a column for each t

  double ParameterAt(int i) const { return static_cast<double>(i) / intervals_; }

  // Returns the error.
  double FitEdge(size_t e, PlaceSampler& samples) {
    const DomainEdge& domain = domains_.edges[e];
    Eigen::Matrix3Xd points(3, intervals_ + 1);
    for (int i = 0; i <= intervals_; ++i) points.col(i) = samples.At(domain.At(ParameterAt(i)));
    points.col(0) = shell_.vertices.col(domain.from);
    points.col(intervals_) = shell_.vertices.col(domain.to);
    BicubicShell::Edge& edge = shell_.edges[e];
    edge.from = domain.from;
    edge.to = domain.to;
    for (size_t k = 0;; ++k) {
      edge.control = splines_[k].FitCurve(points);
      fineness_[e] = static_cast<int>(k);
      const double error =
          (edge.control * splines_[k].basis().transpose() - points).colwise().norm().maxCoeff();
      if (error <= kEdgeShare * tolerance_ || k + 1 == splines_.size()) return error;
    }
  }

  // The curve of edge i of a patch in control points of `fine`, from s or t = 0 to 1. Its own
  // splines are sums of these.
  Eigen::Matrix3Xd SideOf(const DomainPatch& patch, size_t i, const CubicSpline& fine) const {
    const auto e = static_cast<size_t>(patch.edges[i]);
    const CubicSpline& own = splines_[static_cast<size_t>(fineness_[e])];
    Eigen::Matrix3Xd control = shell_.edges[e].control;
    if (fine.spans() != own.spans()) {
      control = fine.FitCurve(control * own.basis().transpose());
    }
    // Edges 2 and 3 run against s and t.
    return patch.forward[i] == (i < 2) ? control : control.rowwise().reverse().eval();
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
      const MatrixXd rest = samples - along_s.basis() * grid * along_t.basis().transpose();
      grid.block(1, 1, rows - 2, columns - 2) =
          along_s.inner_fit() * rest * along_t.inner_fit().transpose();
      squared += (along_s.basis() * grid * along_t.basis().transpose() - samples).array().square();
    }
    return std::sqrt(squared.maxCoeff());
  }

  // Returns the error.
  double FitPatch(size_t p, PlaceSampler& samples) {
    const DomainPatch& domain = domains_.patches[p];
    Grid points;
    for (MatrixXd& axis : points) axis.resize(intervals_ + 1, intervals_ + 1);
    for (int j = 0; j <= intervals_; ++j) {
      for (int i = 0; i <= intervals_; ++i) {
        const Eigen::Vector3d point = samples.At(domain.At(ParameterAt(i), ParameterAt(j)));
        for (size_t axis = 0; axis < 3; ++axis) {
          points[axis](i, j) = point[static_cast<Eigen::Index>(axis)];
        }
      }
    }
    const auto fineness = [&](size_t i) { return fineness_[static_cast<size_t>(domain.edges[i])]; };
    auto k = static_cast<size_t>(std::max(fineness(0), fineness(2)));
    auto l = static_cast<size_t>(std::max(fineness(1), fineness(3)));
    const size_t finest = splines_.size() - 1;
    Grid control;
    double error;
    while (true) {
      std::array<Eigen::Matrix3Xd, 4> sides;
      for (size_t i = 0; i < 4; ++i) sides[i] = SideOf(domain, i, splines_[i % 2 == 0 ? k : l]);
      error = FitInside(splines_[k], splines_[l], points, sides, &control);
      if (error <= tolerance_ || (k == finest && l == finest)) break;
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
  const SurfaceLattice& lattice_;
  const int intervals_;
  const double tolerance_;
  std::vector<CubicSpline> splines_;  // of 1, 2, 4, ... spans
  std::vector<int> fineness_;         // of each edge: place in splines_
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
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceLattice lattice, SurfaceLattice::Build(surface, context));
  const int intervals = (1 << lattice.level()) / (surface.control_mesh.quads() ? 1 : 2);
  ShellFit fit(domains, lattice, intervals, options.tolerance);
  RILIEVO_ASSIGN_OR_RETURN(BicubicShell shell, fit.Run(context));
  MoveToScanFrame(surface.frame, shell.vertices);
  for (BicubicShell::Edge& edge : shell.edges) MoveToScanFrame(surface.frame, edge.control);
  for (BicubicShell::Patch& patch : shell.patches) MoveToScanFrame(surface.frame, patch.control);
  return shell;
}

}  // namespace rilievo
