#include "client/cli/given_cage.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_reader.h"
#include "core/base/status_macros.h"
#include "core/loop/crease_topology.h"

namespace rilievo {

absl::StatusOr<GivenCage> ReadGivenCage(const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMesh(path));
  if (file.mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": points without a face; a mesh is needed"));
  }
  GivenCage cage;
  cage.mesh = PolygonsOf(file);
  cage.place = std::move(file.place);
  if (!file.tags) return cage;
  cage.tags = {std::move(file.tags->creases), std::move(file.tags->corners)};
  SortTags(&cage.tags.creases, &cage.tags.corners);
  return cage;
}

}  // namespace rilievo
