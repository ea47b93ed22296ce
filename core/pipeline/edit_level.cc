#include "core/pipeline/edit_level.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/colors.h"
#include "core/codec/container/deformed_surface.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/mesh/prepare_control_mesh.h"

namespace rilievo {
namespace {

// Digits lost on the way through text.
constexpr double kUnmoved = 1e-9;
// Of the file's step: heights that were rounded once are rounded again, to half of that error.
constexpr double kShareOfStep = 0.5, kMostStep = 0.01;

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

// Of the finest level with coefficients; 0 where there is none.
double HeightStepOf(const OpenedDss& file) {
  if (file.version == 1) return file.header.height_unit;
  double step = 0;
  for (const Chunk& layer : file.layers) {
    ByteReader reader(layer.payload);
    if ((reader.Byte() & kEmptyLayerFlag) != 0) continue;
    step = static_cast<double>(reader.Varint()) * file.header.height_unit;
  }
  return step;
}

EncodeOptions OptionsFor(const OpenedDss& file) {
  EncodeOptions options;
  options.position_step = file.header.position_step;
  options.height_step = std::min(kShareOfStep * HeightStepOf(file), kMostStep);
  return options;
}

}  // namespace

absl::StatusOr<EditedLevel> EditLevel(std::span<const uint8_t> dss, int level,
                                      const TriangleMesh& edited, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(DecodedSurface decoded, DecodeDss(dss, context));
  RILIEVO_RETURN_IF_ERROR(CheckLevel(decoded, level));
  DisplacedSurface& surface = decoded.surface;
  const SpatialFrame& frame = surface.frame;
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh before, Tessellate(surface, level, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const ControlMesh placed,
      ControlMeshOfCage({edited.vertices, edited.triangles}, frame, before.triangles));
  const Eigen::Matrix3Xd& targets = placed.vertices;
  const Eigen::Matrix3Xd own = (before.vertices.colwise() - frame.center) / frame.diagonal;
  if ((targets - own).cwiseAbs().maxCoeff() <= kUnmoved) {
    return EditedLevel{{dss.begin(), dss.end()}, {}};
  }
  RILIEVO_ASSIGN_OR_RETURN(const ControlMesh through,
                           ControlMeshThrough(surface, level, targets, context));
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, /*check_groups=*/false));
  const EncodeOptions options = OptionsFor(file);
  RILIEVO_ASSIGN_OR_RETURN(surface.control_mesh,
                           QuantizeControlMesh(through, options.position_step));
  EditedLevel result;
  RILIEVO_ASSIGN_OR_RETURN(result.missed, MoveHeightsTo(targets, level, context, &surface));
  RILIEVO_ASSIGN_OR_RETURN(EncodedSurface encoded,
                           EncodeDss(surface, OfAnotherShape(decoded.metadata), options, context));
  if (!surface.colors.empty()) {
    RILIEVO_RETURN_IF_ERROR(AddColors(surface, std::nullopt, context, &encoded).status());
  }
  result.dss = encoded.Concatenate();
  return result;
}

}  // namespace rilievo
