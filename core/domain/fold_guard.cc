#include "core/domain/fold_guard.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int kPasses = 5;
// An old fold may grow by so much in a move, as it passes from face to face, and up to this share
// of its face: scans with many folds would hardly be fitted otherwise.
constexpr double kMostGrowth = 1.5;
constexpr double kSmallShare = 0.1;

// The control points on which the limit surface over a control face depends: the rings of its
// corners.
void MarkSupport(const DomainSamples& samples, Eigen::Index face, std::vector<uint8_t>* marks) {
  const VertexRings& rings = samples.control_rings;
  for (int k = 0; k < 3; ++k) {
    const auto v = static_cast<size_t>(samples.refinement.levels.front().faces(k, face));
    for (int e = rings.neighbor_begin[v]; e < rings.neighbor_begin[v + 1]; ++e) {
      (*marks)[static_cast<size_t>(rings.neighbors[static_cast<size_t>(e)])] = 1;
    }
  }
}

// Per control face: the sum over the faces around its corners.
std::vector<double> SumAround(const DomainSamples& samples, const std::vector<double>& of_face) {
  const auto& faces = samples.refinement.levels.front().faces;
  std::vector<double> at_vertex(static_cast<size_t>(samples.control_vertex_count()), 0);
  std::vector<double> sums(of_face.size(), 0);
  for (size_t face = 0; face < of_face.size(); ++face) {
    for (int k = 0; k < 3; ++k) {
      at_vertex[static_cast<size_t>(faces(k, static_cast<Eigen::Index>(face)))] += of_face[face];
    }
  }
  for (size_t face = 0; face < of_face.size(); ++face) {
    for (int k = 0; k < 3; ++k) {
      sums[face] += at_vertex[static_cast<size_t>(faces(k, static_cast<Eigen::Index>(face)))];
    }
  }
  return sums;
}

}  // namespace

FoldedAreas FindFolds(const DomainSamples& samples, const SampledSurface& surface,
                      const RunContext& context) {
  const MeshTopology& fine = samples.finest();
  const int descendants = fine.face_count() / samples.control_face_count();
  const auto count = static_cast<size_t>(samples.control_face_count());
  FoldedAreas areas{std::vector<double>(count, 0), std::vector<double>(count, 0)};
  const auto add = [&](int face, size_t control_face) {
    const auto corner = [&](int k) { return surface.positions.col(fine.faces(k, face)); };
    const Eigen::Vector3d side = corner(1) - corner(0);
    const Eigen::Vector3d normal = side.cross(corner(2) - corner(0));
    bool turned = false;
    for (int k = 0; k < 3; ++k) turned |= normal.dot(surface.normals.col(fine.faces(k, face))) <= 0;
    // A triangle without area is folded, too.
    const double area = std::max(normal.norm() / 2, std::numeric_limits<double>::min());
    areas.whole[control_face] += area;
    if (turned) areas.folded[control_face] += area;
  };
  ParallelFor(samples.control_face_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
    for (int64_t control_face = begin; control_face < end; ++control_face) {
      for (int k = 0; k < descendants; ++k) {
        add(static_cast<int>(control_face * descendants + k), static_cast<size_t>(control_face));
      }
    }
  }).IgnoreError();
  return areas;
}

absl::Status UndoFolds(const DomainSamples& samples, const Eigen::Matrix3Xd& before,
                       const FoldedAreas& folds_before, const RunContext& context,
                       Eigen::Matrix3Xd* control_points, SampledSurface* surface) {
  if (IsLeftOut(Mechanism::kFoldGuard)) return absl::OkStatus();
  const std::vector<double> around_before = SumAround(samples, folds_before.folded);
  for (int pass = 1; pass <= kPasses; ++pass) {
    const FoldedAreas folds = FindFolds(samples, *surface, context);
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const std::vector<double> around = SumAround(samples, folds.folded);
    std::vector<uint8_t> undo(static_cast<size_t>(samples.control_vertex_count()), 0);
    bool any = false;
    for (size_t face = 0; face < around.size(); ++face) {
      if (!(folds.folded[face] > 0)) continue;
      const bool old = folds_before.folded[face] > 0;
      const bool bearable = around[face] <= kMostGrowth * around_before[face] ||
                            folds.folded[face] <= kSmallShare * folds.whole[face];
      if (old && bearable) continue;
      any = true;
      MarkSupport(samples, static_cast<Eigen::Index>(face), &undo);
    }
    if (!any) return absl::OkStatus();
    const double kept = pass < kPasses ? 0.5 : 0.0;
    for (int v = 0; v < samples.control_vertex_count(); ++v) {
      if (!undo[static_cast<size_t>(v)]) continue;
      control_points->col(v) = before.col(v) + kept * (control_points->col(v) - before.col(v));
    }
    RILIEVO_RETURN_IF_ERROR(SampleSurface(samples, *control_points, context, surface));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
