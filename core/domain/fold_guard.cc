#include "core/domain/fold_guard.h"

#include <Eigen/Geometry>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/geometry/vertex_ring.h"

namespace rilievo {
namespace {

// The control points on which the limit surface over a control face depends: the rings of its
// corners.
void MarkSupport(const DomainSamples& samples, Eigen::Index face, std::vector<uint8_t>* marks) {
  const VertexRings& rings = samples.control_rings;
  for (int k = 0; k < 3; ++k) {
    const int v = samples.refinement.levels.front().faces(k, face);
    for (const int other : RingOf(rings, v)) (*marks)[other] = 1;
  }
}

}  // namespace

std::vector<uint8_t> FindFolds(const DomainSamples& samples, const SampledSurface& surface,
                               const RunContext& context) {
  const MeshTopology& fine = samples.finest();
  const int descendants = fine.face_count() / samples.control_face_count();
  std::vector<uint8_t> folded(static_cast<size_t>(samples.control_face_count()), 0);
  const auto is_turned = [&](int face) {
    const auto corner = [&](int k) { return surface.positions.col(fine.faces(k, face)); };
    const Eigen::Vector3d side = corner(1) - corner(0);
    const Eigen::Vector3d normal = side.cross(corner(2) - corner(0));
    bool turned = false;
    for (int k = 0; k < 3; ++k) turned |= normal.dot(surface.normals.col(fine.faces(k, face))) <= 0;
    return turned;
  };
  ParallelForEach(samples.control_face_count(), kHeavyBlock, context, [&](int64_t control_face) {
    for (int k = 0; k < descendants && folded[control_face] == 0; ++k) {
      folded[control_face] = is_turned(static_cast<int>(control_face * descendants + k));
    }
  }).IgnoreError();
  return folded;
}

absl::Status UndoFolds(const DomainSamples& samples, const Eigen::Matrix3Xd& before,
                       const std::vector<uint8_t>& folded_before, const RunContext& context,
                       Eigen::Matrix3Xd* control_points, SampledSurface* surface) {
  if (IsLeftOut(Mechanism::kFoldGuard)) return absl::OkStatus();
  for (int pass = 1; pass <= kFoldGuard.passes; ++pass) {
    const std::vector<uint8_t> folded = FindFolds(samples, *surface, context);
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<uint8_t> undo(static_cast<size_t>(samples.control_vertex_count()), 0);
    bool any = false;
    for (size_t face = 0; face < folded.size(); ++face) {
      if (folded[face] == 0 || folded_before[face] != 0) continue;
      any = true;
      MarkSupport(samples, static_cast<Eigen::Index>(face), &undo);
    }
    if (!any) return absl::OkStatus();
    const double kept = pass < kFoldGuard.passes ? 0.5 : 0.0;
    for (int v = 0; v < samples.control_vertex_count(); ++v) {
      if (!undo[static_cast<size_t>(v)]) continue;
      control_points->col(v) = before.col(v) + kept * (control_points->col(v) - before.col(v));
    }
    RILIEVO_RETURN_IF_ERROR(SampleSurface(samples, *control_points, context, surface));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
