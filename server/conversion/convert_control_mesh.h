// A given control mesh from the protocol's words.
#pragma once

#include <vector>

#include "core/control/control_options.h"
#include "rilievo/v1/options.pb.h"
#include "server/conversion/option_reader.h"

namespace rilievo {

// Sizes, indices and finiteness; whether it is a manifold, and whether its creases are edges, is
// found out by the control stage. What is wrong is added to `violations`.
void ReadControlMesh(const v1::ControlMesh& from, ControlOptions* control,
                     std::vector<FieldViolation>* violations);

}  // namespace rilievo
