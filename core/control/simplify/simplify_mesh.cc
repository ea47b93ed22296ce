#include "core/control/simplify/simplify_mesh.h"

#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/control/simplify/edge_collapser.h"
#include "core/control/simplify/half_edge_mesh.h"
#include "core/control/simplify/settings.h"
#include "core/control/simplify/vertex_blocks.h"

namespace rilievo {
namespace {

// The share of its faces that the blocks leave of a mesh.
double BlockShare(const ControlMesh& mesh, const SimplifyOptions& options) {
  return options.unordered_until * options.target_faces / static_cast<double>(mesh.faces.cols());
}

// Most of a large mesh goes block by block.
bool GoesByBlocks(const ControlMesh& mesh, double share) {
  return share < 0.5 && mesh.vertices.cols() > 2 * kSimplifyMesh.block_size;
}

}  // namespace

absl::StatusOr<ControlMesh> SimplifyMesh(ControlMesh mesh, const SimplifyOptions& options,
                                         const RunContext& context, const FacePlanes* planes) {
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (!mesh.vertices.allFinite()) {
    return absl::InvalidArgumentError("the mesh to simplify has a vertex that is not finite");
  }
  RILIEVO_ASSIGN_OR_RETURN(
      HalfEdgeMesh half_edges,
      HalfEdgeMesh::Build(mesh.faces, static_cast<int>(mesh.vertices.cols()), context));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  const double share = BlockShare(mesh, options);
  std::optional<VertexBlocks> blocks;
  if (GoesByBlocks(mesh, share)) {
    RILIEVO_ASSIGN_OR_RETURN(
        blocks, CutIntoBlocks(half_edges, mesh.vertices, kSimplifyMesh.block_size, context));
  }
  EdgeCollapser collapser(std::move(half_edges), std::move(mesh), options, planes, context);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  if (blocks) {
    RILIEVO_RETURN_IF_ERROR(collapser.CollapseBlocks(*blocks, share, context));
    blocks.reset();
  }
  for (const double milestone : kSimplifyMesh.milestones) {
    const auto faces = static_cast<int64_t>(milestone * options.target_faces);
    if (collapser.faces_left() <= faces) continue;
    RILIEVO_RETURN_IF_ERROR(
        collapser.CollapseTo(faces, milestone >= kSimplifyMesh.coarse_until, context));
  }
  return collapser.Compact();
}

}  // namespace rilievo
