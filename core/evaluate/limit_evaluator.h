// The limit surface of a control mesh at any parameter.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/evaluate/irregular_fan.h"
#include "core/evaluate/patch_place.h"
#include "core/evaluate/quad_evaluator.h"
#include "core/evaluate/quartic_patch.h"
#include "core/evaluate/surface_jet.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Exact: a regular part of a face of a Loop surface is a quartic box spline; a part beside an
// irregular vertex is cut into regular ones around the parameter asked for (irregular_fan.h),
// however near to the vertex that is. Catmull-Clark surfaces: quad_evaluator.h. Creases, darts,
// corners, boundaries and semi-sharp edges follow crease_masks.h.
//
// A table of patches is made once; asking it changes nothing, so any number of threads may.
class LimitEvaluator {
 public:
  // Errors as RefineTopology; RESOURCE_EXHAUSTED where semi-sharp edges would need more patches
  // than kMostPatches and 64 a face.
  static absl::StatusOr<LimitEvaluator> Build(const ControlMesh& mesh, const RunContext& context);
  static constexpr int64_t kMostPatches = int64_t{1} << 20;
  // That refusal, of so many patches for so many control faces.
  static absl::Status CheckPatchCount(int64_t patches, int64_t faces);

  int face_count() const { return quads_ ? quads_->face_count() : static_cast<int>(roots_.size()); }

  // INVALID_ARGUMENT unless 0 <= face < face_count(), u >= 0, v >= 0 and u + v <= 1, but for
  // kParameterSlack of rounding.
  absl::Status Check(int64_t face, double u, double v) const;
  static constexpr double kParameterSlack = 1e-9;

  // In the frame of the control mesh, for what Check() accepts. On a crease, boundary or corner the
  // derivatives are those of the face's own side.
  SurfaceJet At(int face, double u, double v, JetOrder order) const {
    return AtPlace(Find(face, u, v), order);
  }

  // At() in two steps: Find() asks the memory for what AtPlace() reads, so a caller that finds
  // other places in between does not wait for it.
  PatchPlace Find(int face, double u, double v) const;
  SurfaceJet AtPlace(const PatchPlace& place, JetOrder order) const;

 private:
  friend class PatchTreeBuilder;
  // A face cut into its four children. A child is a node, or ~(2 p), patch p, or ~(2 f + 1), fan f.
  using Node = std::array<int32_t, 4>;
  struct Fan {
    IrregularFan fan;
    int corner;                            // of the control face
    Eigen::Vector3d limit;                 // of its vertex
    Eigen::Vector3d tangent_u, tangent_v;  // there, on the face's side
  };
  // Of the weights of its corners b and c.
  SurfaceJet AtFan(const Fan& fan, double b, double c, JetOrder order) const;
  // Of the parameters of the face that the fan is.
  SurfaceJet AtTurnedFan(const Fan& fan, double u, double v, JetOrder order) const;

  std::optional<QuadEvaluator> quads_;  // of a Catmull-Clark surface, and nothing else
  std::vector<int32_t> roots_;          // of each control face, coded as a child
  std::vector<Node> nodes_;
  std::vector<QuarticPatch> patches_;
  std::vector<Fan> fans_;
};

}  // namespace rilievo
