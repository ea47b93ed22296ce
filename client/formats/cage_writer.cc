#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/number_text.h"
#include "client/formats/surface_writer.h"
#include "core/base/status_macros.h"

namespace rilievo {

absl::Status WriteObjCage(const ControlMesh& mesh, const SpatialFrame& frame, std::ostream& out) {
  const TriangleMesh cage{
      (mesh.vertices * frame.diagonal).colwise() + frame.center, mesh.faces, {}};
  RILIEVO_RETURN_IF_ERROR(WriteObjMesh(cage, out));
  std::string tags;
  for (const Crease& crease : mesh.creases) {
    absl::StrAppend(&tags, "t crease 2/1/0 ", crease.a, " ", crease.b, " ");
    AppendNumber(std::min(crease.sharpness, kInfiniteSharpness), &tags);
    tags += '\n';
  }
  for (const int corner : mesh.corners) {
    absl::StrAppend(&tags, "t corner 1/1/0 ", corner, " ", kInfiniteSharpness, "\n");
  }
  // A tag of no edge: nothing is sharp. No tag at all would mean that an editor dropped them.
  if (tags.empty()) tags = absl::StrCat("t crease 0/1/0 ", kInfiniteSharpness, "\n");
  out << tags;
  return absl::OkStatus();
}

}  // namespace rilievo
