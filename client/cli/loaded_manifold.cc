#include "client/cli/loaded_manifold.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/booleans/solid_of_mesh.h"
#include "server/command_line/text_layout.h"

namespace rilievo {

absl::StatusOr<LoadedShape> LoadManifold(const std::string& path, const std::string& format,
                                         const PlaceArguments& place, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(LoadedShape shape, LoadShape(path, std::nullopt, context, format));
  shape.place = PlaceOf(place, std::move(shape.place));
  if (shape.diagonal > 0) return shape;
  if (shape.mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": ", Counted(shape.mesh.vertices.cols(), "point", "points"),
        " without a face; triangles are needed, so make a surface of them first ('rilievo "
        "reconstruct')"));
  }
  PointCloud cloud;
  cloud.points = std::move(shape.mesh.vertices);
  cloud.triangles = std::move(shape.mesh.triangles);
  absl::StatusOr<TriangleMesh> manifold = SolidOfMesh(cloud, context);
  if (!manifold.ok()) {
    return absl::Status(manifold.status().code(),
                        absl::StrCat(path, ": ", manifold.status().message()));
  }
  shape.mesh = *std::move(manifold);
  return shape;
}

}  // namespace rilievo
