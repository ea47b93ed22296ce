#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/number_text.h"
#include "client/formats/surface_writer.h"
#include "core/base/status_macros.h"
#include "core/loop/refinement.h"

namespace rilievo {

void WriteObjTags(const std::vector<Crease>& creases, const std::vector<int>& corners,
                  std::ostream& out) {
  std::string tags;
  for (const Crease& crease : creases) {
    absl::StrAppend(&tags, "t crease 2/1/0 ", crease.a, " ", crease.b, " ");
    AppendNumber(std::min(crease.sharpness, kInfiniteSharpness), &tags);
    tags += '\n';
  }
  for (const int corner : corners) {
    absl::StrAppend(&tags, "t corner 1/1/0 ", corner, " ", kInfiniteSharpness, "\n");
  }
  out << tags;
}

absl::Status WriteObjCage(const ControlMesh& mesh, const SpatialFrame& frame, std::ostream& out) {
  const Eigen::Matrix3Xd vertices = (mesh.vertices * frame.diagonal).colwise() + frame.center;
  if (mesh.quads()) {
    RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                             RefineTopology(mesh, 0, RunContext()));
    PolygonMesh cage{
        vertices, {0}, CornersOfQuads(refinement.levels[0], refinement.quads.levels[0])};
    for (int end = 4; end <= static_cast<int>(cage.corners.size()); end += 4) {
      cage.begin.push_back(end);
    }
    RILIEVO_RETURN_IF_ERROR(WriteObjPolygons(cage, out));
  } else {
    RILIEVO_RETURN_IF_ERROR(WriteObjMesh({vertices, mesh.faces, {}}, out));
  }
  WriteObjTags(mesh.creases, mesh.corners, out);
  // A tag of no edge: nothing is sharp. No tag at all would mean that an editor dropped them.
  if (mesh.creases.empty() && mesh.corners.empty()) {
    out << absl::StrCat("t crease 0/1/0 ", kInfiniteSharpness, "\n");
  }
  return absl::OkStatus();
}

}  // namespace rilievo
