// A control mesh that came back from an editor.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct EditedCage {
  ControlMesh mesh;     // scan frame
  bool tagged = false;  // whether the file says what is sharp; else it is as in the surface
};

// The cage of `path`: an OBJ or PLY, or a .dss, of which the first chunk is enough. `own`: the
// control mesh of `surface`, whose tags stand where the file has none, since editors that do not
// know them drop them. `sharpness`: of all creases, 0: no creases and no corners; nullopt: as they
// are. Errors name the path; kUsage for a file with a unit and a way up of its own.
absl::StatusOr<EditedCage> ReadEditedCage(const std::string& path, const std::string& surface,
                                          const ControlMesh& own, std::optional<double> sharpness,
                                          const RunContext& context);

}  // namespace rilievo
