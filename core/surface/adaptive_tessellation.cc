#include "core/surface/adaptive_tessellation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/patch_lattice.h"
#include "core/loop/refinement.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/red_green_forest.h"
#include "core/surface/triangle_distance.h"

namespace rilievo {
namespace {

using Triangles = std::vector<std::array<int, 3>>;

class AdaptiveTessellation {
 public:
  // `finest`: the finest level in the unit frame. `levels`: those before it, at least one.
  // `camera`: in the unit frame, or null.
  AdaptiveTessellation(const TriangleMesh& finest, std::span<const MeshTopology> levels,
                       const Eigen::Vector3d* camera)
      : finest_(finest), levels_(levels) {
    if (camera != nullptr) {
      constexpr double kNearest = 1e-6;  // a camera on the surface sees a point of it
      const Eigen::VectorXd away = (finest.vertices.colwise() - *camera).colwise().squaredNorm();
      squared_scale_ = away.array().max(kNearest * kNearest).inverse();
    } else {
      squared_scale_ = Eigen::ArrayXd::Ones(finest.vertices.cols());
    }
    for (size_t level = 0; level < levels.size(); ++level) {
      lattices_.emplace_back(static_cast<int>(levels.size() - level));
    }
    for (size_t level = 0; level < levels.size(); ++level) {
      numberings_.emplace_back(levels[level], lattices_[level]);
    }
  }

  // How far what lies under each face is from it.
  absl::Status MeasureFaces(const RunContext& context) {
    errors_.resize(levels_.size());
    for (size_t level = 0; level < levels_.size(); ++level) {
      errors_[level].resize(levels_[level].face_count());
      RILIEVO_RETURN_IF_ERROR(ParallelFor(
          levels_[level].face_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
            Triangles triangles(1);
            for (int f = static_cast<int>(begin); f < static_cast<int>(end); ++f) {
              const auto face = levels_[level].faces.col(f);
              triangles[0] = {face[0], face[1], face[2]};
              errors_[level][f] = DistanceUnder({static_cast<int>(level), f}, triangles);
            }
          }));
    }
    return absl::OkStatus();
  }

  RedGreenForest WithinTolerance(double tolerance) const {
    RedGreenForest forest = CutWhereAbove(tolerance);
    // A face cut in two or three may stand off where the whole one did not.
    std::vector<LevelFace> made;
    do {
      std::vector<LevelFace> too_far;
      forest.ForEachLeaf([&](LevelFace leaf) {
        if (forest.HasCutNeighbor(leaf) && LeafError(forest, leaf) > tolerance) {
          too_far.push_back(leaf);
        }
      });
      made.clear();
      for (LevelFace leaf : too_far) forest.Cut(leaf, made);
      const std::vector<LevelFace> next = made;
      CutAbove(tolerance, next, forest);
    } while (!made.empty());
    return forest;
  }

  RedGreenForest WithinTriangles(int64_t most) const {
    double low = 0, high = 0;  // too many triangles, few enough
    for (const auto& errors : errors_) {
      high = std::max(high, *std::max_element(errors.begin(), errors.end()));
    }
    RedGreenForest best(levels_);
    RedGreenForest all = WithinTolerance(0);
    if (CountTriangles(all) <= most) return all;
    constexpr int kRounds = 20;
    constexpr double kLeast = 1e-9;
    for (int round = 0; round < kRounds && high > kLeast; ++round) {
      const double middle = std::sqrt(std::max(low, kLeast / 2) * high);
      RedGreenForest forest = WithinTolerance(middle);
      if (CountTriangles(forest) <= most) {
        best = std::move(forest);
        high = middle;
      } else {
        low = middle;
      }
    }
    return best;
  }

  AdaptiveMesh MeshOf(const RedGreenForest& forest, const SpatialFrame& frame) const {
    AdaptiveMesh adaptive;
    std::vector<int> number(finest_.vertices.cols(), -1);
    Triangles all, triangles;
    forest.ForEachLeaf([&](LevelFace leaf) {
      forest.TrianglesOf(leaf, IsShorter(), triangles);
      all.insert(all.end(), triangles.begin(), triangles.end());
      adaptive.error = std::max(adaptive.error, LeafError(forest, leaf));
    });
    for (const auto& triangle : all) {
      for (int v : triangle) number[v] = 0;
    }
    for (int v = 0; v < static_cast<int>(number.size()); ++v) {
      if (number[v] < 0) continue;
      number[v] = static_cast<int>(adaptive.vertices.size());
      adaptive.vertices.push_back(v);
    }
    TriangleMesh& mesh = adaptive.mesh;
    mesh.vertices.resize(3, static_cast<Eigen::Index>(adaptive.vertices.size()));
    mesh.normals.resize(3, mesh.vertices.cols());
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
      mesh.vertices.col(v) = frame.ScanFromUnit(finest_.vertices.col(adaptive.vertices[v]));
      mesh.normals.col(v) = finest_.normals.col(adaptive.vertices[v]);
    }
    mesh.triangles.resize(3, static_cast<Eigen::Index>(all.size()));
    for (size_t t = 0; t < all.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        mesh.triangles(k, static_cast<Eigen::Index>(t)) = number[all[t][k]];
      }
    }
    return adaptive;
  }

 private:
  // Largest distance of what lies under a face from the triangles that stand for it, as the camera
  // sees it if there is one. Distance from
  // one triangle is convex, so its values at the corners bound it on a finest triangle. Where
  // several stand for the face, the lines between them run along finest edges and medians of finest
  // triangles: each half may be near another one.
  double DistanceUnder(LevelFace at, const Triangles& triangles) const {
    std::vector<int> vertices;
    numberings_[at.level].VerticesOf(at.face, vertices);
    const auto squared = [&](const Eigen::Vector3d& point, const std::array<int, 3>& triangle) {
      return SquaredDistanceToTriangle(point, finest_.vertices.col(triangle[0]),
                                       finest_.vertices.col(triangle[1]),
                                       finest_.vertices.col(triangle[2]));
    };
    double largest = 0;
    if (triangles.size() == 1) {
      for (int v : vertices) {
        largest =
            std::max(largest, squared_scale_[v] * squared(finest_.vertices.col(v), triangles[0]));
      }
      return std::sqrt(largest);
    }
    const auto nearest = [&](const std::array<Eigen::Vector3d, 3>& corners) {
      double least = std::numeric_limits<double>::infinity();
      for (const auto& triangle : triangles) {
        least =
            std::min(least, std::max({squared(corners[0], triangle), squared(corners[1], triangle),
                                      squared(corners[2], triangle)}));
      }
      return least;
    };
    for (const auto under : lattices_[at.level].triangles().colwise()) {
      std::array<Eigen::Vector3d, 3> p;
      double scale = 0;
      for (int k = 0; k < 3; ++k) {
        p[k] = finest_.vertices.col(vertices[under[k]]);
        scale = std::max(scale, squared_scale_[vertices[under[k]]]);
      }
      double least = scale * nearest(p);
      for (int k = 0; k < 3 && least > largest; ++k) {
        const Eigen::Vector3d &top = p[k], &left = p[(k + 1) % 3], &right = p[(k + 2) % 3];
        const Eigen::Vector3d middle = 0.5 * (left + right);
        least = std::min(
            least, scale * std::max(nearest({top, left, middle}), nearest({top, middle, right})));
      }
      largest = std::max(largest, least);
    }
    return std::sqrt(largest);
  }

  double LeafError(const RedGreenForest& forest, LevelFace leaf) const {
    if (leaf.level == forest.finest_level()) return 0;
    if (!forest.HasCutNeighbor(leaf)) return errors_[leaf.level][leaf.face];
    Triangles triangles;
    forest.TrianglesOf(leaf, IsShorter(), triangles);
    return DistanceUnder(leaf, triangles);
  }

  void CutAbove(double tolerance, std::vector<LevelFace> left, RedGreenForest& forest) const {
    while (!left.empty()) {
      const LevelFace at = left.back();
      left.pop_back();
      if (at.level == forest.finest_level() || !(errors_[at.level][at.face] > tolerance)) continue;
      forest.Cut(at, left);
    }
  }

  RedGreenForest CutWhereAbove(double tolerance) const {
    RedGreenForest forest(levels_);
    std::vector<LevelFace> roots;
    for (int f = 0; f < levels_.front().face_count(); ++f) roots.push_back({0, f});
    CutAbove(tolerance, std::move(roots), forest);
    return forest;
  }

  int64_t CountTriangles(const RedGreenForest& forest) const {
    int64_t count = 0;
    Triangles triangles;
    forest.ForEachLeaf([&](LevelFace leaf) {
      forest.TrianglesOf(leaf, IsShorter(), triangles);
      count += static_cast<int64_t>(triangles.size());
    });
    return count;
  }

  RedGreenForest::IsShorter IsShorter() const {
    return [this](RedGreenForest::Diagonal x, RedGreenForest::Diagonal y) {
      const auto length = [&](RedGreenForest::Diagonal d) {
        return (finest_.vertices.col(d.first) - finest_.vertices.col(d.second)).squaredNorm();
      };
      return length(x) < length(y);
    };
  }

  const TriangleMesh& finest_;
  std::span<const MeshTopology> levels_;
  std::vector<PatchLattice> lattices_;  // from each level to the finest
  std::vector<PatchNumbering> numberings_;
  std::vector<std::vector<double>> errors_;
  Eigen::ArrayXd squared_scale_;  // per finest vertex: of squared distances
};

}  // namespace

absl::Status AdaptiveOptions::Validate() const {
  if (tolerance.has_value() == triangles.has_value()) {
    return absl::InvalidArgumentError("give either a tolerance or a number of triangles");
  }
  if (tolerance && !(*tolerance >= 0 && *tolerance <= 1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("tolerance is ", *tolerance, ", must lie in [0, 1], of the diagonal"));
  }
  if (camera && !camera->allFinite()) {
    return absl::InvalidArgumentError("camera is not finite: give a place in the scan's frame");
  }
  return absl::OkStatus();
}

absl::StatusOr<AdaptiveMesh> TessellateAdaptively(const DisplacedSurface& surface,
                                                  const AdaptiveOptions& options,
                                                  const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_ASSIGN_OR_RETURN(
      TriangleMesh finest,
      TessellateInUnitFrame(surface, surface.max_level, /*with_normals=*/true, context));
  const int64_t control_faces = surface.control_mesh.faces.cols();
  if (options.triangles && *options.triangles < control_faces) {
    return absl::InvalidArgumentError(
        absl::StrCat("triangles ", *options.triangles, ": the surface has at least ", control_faces,
                     ", those of its control mesh; ask for as many or more"));
  }
  if (surface.max_level == 0) {
    AdaptiveMesh whole;
    for (Eigen::Index v = 0; v < finest.vertices.cols(); ++v) {
      finest.vertices.col(v) = surface.frame.ScanFromUnit(finest.vertices.col(v));
      whole.vertices.push_back(static_cast<int>(v));
    }
    whole.mesh = std::move(finest);
    return whole;
  }
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(surface.control_mesh, surface.max_level - 1, context));
  std::optional<Eigen::Vector3d> camera;
  if (options.camera) camera = surface.frame.UnitFromScan(*options.camera);
  AdaptiveTessellation tessellation(finest, refinement.levels, camera ? &*camera : nullptr);
  RILIEVO_RETURN_IF_ERROR(tessellation.MeasureFaces(context));
  const RedGreenForest forest = options.tolerance
                                    ? tessellation.WithinTolerance(*options.tolerance)
                                    : tessellation.WithinTriangles(*options.triangles);
  return tessellation.MeshOf(forest, surface.frame);
}

}  // namespace rilievo
