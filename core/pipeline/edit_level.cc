#include "core/pipeline/edit_level.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/container/colors.h"
#include "core/codec/container/deformed_surface.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

absl::Status CheckLevel(const DecodedSurface& decoded, int level) {
  const int finest = decoded.surface.max_level;
  if (finest < decoded.declared_max_level) {
    return absl::FailedPreconditionError(absl::StrCat("the file ends at level ", finest, " of ",
                                                      decoded.declared_max_level,
                                                      "; an edited level needs all of them"));
  }
  if (level >= 0 && level <= finest) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("level is ", level, ", this surface has 0 to ", finest));
}

EncodeOptions OptionsFor(const OpenedDss& file) {
  EncodeOptions options;
  options.position_step = file.header.position_step;
  options.border_digits = file.header.border_digits;
  options.keep_zero_border = options.border_digits > 0;
  const double own = HeightStepOf(file);
  const double finer =
      std::max(kEditSurface.share_of_step * own, std::min(own, kEditSurface.least_step));
  options.height_step = std::min(finer, kMaxStep);
  options.group_faces = file.header.group_limit;
  return options;
}

// A filled height is coded as whatever takes the fewest bits, so those that the edit has moved are
// filled ones no more. Rounding the control points moves heights by less than their step.
void KeepEditedHeights(const std::vector<float>& before, double position_step,
                       DisplacedSurface* surface) {
  for (size_t v = 0; v < before.size(); ++v) {
    HeightSource& source = surface->sources[v];
    if (source != HeightSource::kFilled) continue;
    const double moved = std::abs(double{surface->heights[v]} - double{before[v]});
    if (moved > position_step) source = HeightSource::kSmoothed;
  }
}

// Between the vertices of the file and their targets, scan frame, as fractions of the diagonal.
absl::StatusOr<TargetsMissed> MissedBy(std::span<const uint8_t> dss, int level,
                                       const Eigen::Matrix3Xd& targets, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(dss, context));
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh found, Tessellate(decoded.surface, level, context));
  const Eigen::RowVectorXd apart =
      (found.vertices - targets).colwise().norm() / decoded.surface.frame.diagonal;
  return TargetsMissed{apart.norm() / std::sqrt(static_cast<double>(apart.size())),
                       apart.maxCoeff()};
}

}  // namespace

absl::StatusOr<EditedLevel> EditLevel(std::span<const uint8_t> dss, int level,
                                      const TriangleMesh& edited, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(DecodedSurface decoded, DecodeDss(dss, context));
  RILIEVO_RETURN_IF_ERROR(CheckLevel(decoded, level));
  DisplacedSurface& surface = decoded.surface;
  const SpatialFrame& frame = surface.frame;
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh before, Tessellate(surface, level, context));
  const Eigen::Matrix3Xd wanted = WithoutRounding(edited.vertices, before.vertices, frame.diagonal);
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh placed,
                           ControlMeshOfCage({wanted, edited.triangles}, frame, before.triangles));
  if (wanted == before.vertices) return EditedLevel{{dss.begin(), dss.end()}, {}};
  const Eigen::Matrix3Xd& targets = placed.vertices;
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh through,
                           ControlMeshThrough(surface, level, targets, context));
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, /*check_groups=*/false));
  const EncodeOptions options = OptionsFor(file);
  RILIEVO_ASSIGN_OR_RETURN(surface.control_mesh, QuantizeControlMesh(through, options.position_step,
                                                                     options.border_digits));
  const std::vector<float> heights = surface.heights;
  RILIEVO_RETURN_IF_ERROR(MoveHeightsTo(targets, level, context, &surface).status());
  KeepEditedHeights(heights, options.position_step, &surface);
  RILIEVO_ASSIGN_OR_RETURN(EncodedSurface encoded,
                           EncodeDss(surface, OfAnotherShape(decoded.metadata), options, context));
  if (!surface.colors.empty()) {
    RILIEVO_RETURN_IF_ERROR(AddColors(surface, std::nullopt, context, &encoded).status());
  }
  EditedLevel result;
  result.dss = encoded.Concatenate();
  RILIEVO_ASSIGN_OR_RETURN(result.missed, MissedBy(result.dss, level, wanted, context));
  return result;
}

}  // namespace rilievo
