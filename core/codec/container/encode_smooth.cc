#include "core/codec/container/encode_smooth.h"

#include <numeric>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/codec/bytes/stored_step.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/geometry/spatial_frame.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// Room for the rounding of the step itself.
constexpr double kGridMargin = 1.001;

}  // namespace

absl::StatusOr<EncodedSurface> EncodeSmoothSurface(const ControlMesh& mesh, int max_level,
                                                   const DssMetadata& metadata,
                                                   const RunContext& context) {
  std::vector<int> columns(static_cast<size_t>(mesh.vertices.cols()));
  std::iota(columns.begin(), columns.end(), 0);
  DisplacedSurface surface;
  RILIEVO_ASSIGN_OR_RETURN(const SpatialFrame frame, BoundingFrame(mesh.vertices, columns));
  surface.frame = Rounded(frame);
  surface.control_mesh = mesh;
  surface.control_mesh.vertices =
      (mesh.vertices.colwise() - surface.frame.center) / surface.frame.diagonal;
  EncodeOptions options;
  options.position_step = StoredStep(
      kGridMargin * surface.control_mesh.vertices.cwiseAbs().maxCoeff() / kMaxCoordinate);
  RILIEVO_ASSIGN_OR_RETURN(surface.control_mesh,
                           PrepareControlMesh(surface.control_mesh, options.position_step));
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(surface.control_mesh, 0, context));
  surface.max_level = max_level;
  int64_t vertices = refinement.levels[0].vertex_count, edges = refinement.levels[0].edge_count(),
          faces = refinement.levels[0].face_count();
  for (int level = 0; level < max_level; ++level) {
    vertices += edges;
    edges = 2 * edges + 3 * faces;
    faces *= 4;
  }
  surface.heights.assign(static_cast<size_t>(vertices), 0);
  surface.sources.assign(static_cast<size_t>(vertices), HeightSource::kMeasured);
  return EncodeDss(surface, metadata, options, context);
}

}  // namespace rilievo
