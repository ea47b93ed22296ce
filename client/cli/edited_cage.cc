#include "client/cli/edited_cage.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/formats/file_kind.h"
#include "client/formats/mesh_reader.h"
#include "core/base/status_macros.h"
#include "core/codec/container/dss.h"

namespace rilievo {
namespace {

absl::StatusOr<EditedCage> CageOfDss(const std::string& path, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(path));
  const absl::StatusOr<DecodedSurface> decoded = DecodeControlChunk(bytes, context);
  if (!decoded.ok()) return AtPath(path, decoded.status());
  const SpatialFrame& frame = decoded->surface.frame;
  EditedCage cage{decoded->surface.control_mesh, true};
  cage.mesh.vertices = (cage.mesh.vertices * frame.diagonal).colwise() + frame.center;
  return cage;
}

absl::StatusOr<EditedCage> CageOfMesh(const std::string& path, const std::string& surface,
                                      const ControlMesh& own) {
  RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMesh(path));
  if (file.place != ScanPlace{}) {
    return WithExitCode(absl::InvalidArgumentError(absl::StrCat(
                            path, ": a ", file.format,
                            " has its own unit and way up; give the cage as OBJ or PLY, in the "
                            "coordinates of ",
                            surface)),
                        ExitCode::kUsage);
  }
  EditedCage cage{{std::move(file.mesh.vertices), std::move(file.mesh.triangles)},
                  file.tags.has_value()};
  cage.mesh.creases = file.tags ? std::move(file.tags->creases) : own.creases;
  cage.mesh.corners = file.tags ? std::move(file.tags->corners) : own.corners;
  return cage;
}

}  // namespace

absl::StatusOr<EditedCage> ReadEditedCage(const std::string& path, const std::string& surface,
                                          const ControlMesh& own, std::optional<double> sharpness,
                                          const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(EditedCage cage, Extension(path) == "dss"
                                                ? CageOfDss(path, context)
                                                : CageOfMesh(path, surface, own));
  if (!sharpness) return cage;
  if (*sharpness == 0) {
    cage.mesh.creases.clear();
    cage.mesh.corners.clear();
  }
  for (Crease& crease : cage.mesh.creases) crease.sharpness = static_cast<float>(*sharpness);
  return cage;
}

}  // namespace rilievo
