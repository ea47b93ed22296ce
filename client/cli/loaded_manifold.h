// The triangles that a command cuts.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/place_options.h"
#include "core/base/run_context.h"

namespace rilievo {

// A surface at its finest level as it is, a file of triangles as SolidOfMesh() makes it. `format`:
// see AddFormatOption(); `place` overrides what the file says. Errors as LoadShape();
// INVALID_ARGUMENT for points.
absl::StatusOr<LoadedShape> LoadManifold(const std::string& path, const std::string& format,
                                         const PlaceArguments& place, const RunContext& context);

}  // namespace rilievo
