// STEP files of `rilievo export`, by a library that is loaded when one is asked for.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "core/bicubic/bicubic_shell.h"
#include "core/geometry/scan_place.h"

namespace rilievo {

// FAILED_PRECONDITION, saying what to install, where librilievo_step.so is neither in
// ../lib/rilievo beside the folder of this program nor in the folder that RILIEVO_STEP names, or is
// of another version.
absl::Status CheckStepLibrary();

// `shell`: in the scan's coordinates, which become millimetres; a unit that is not known counts as
// one. Where the way up is known it becomes z. `diagonal`: of the surface, in the same unit. Errors
// as CheckStepLibrary() and WriteFileAtomically(); INTERNAL with the words of Open CASCADE.
absl::Status WriteStep(const std::string& output, BicubicShell shell, const ScanPlace& place,
                       double diagonal);

}  // namespace rilievo
