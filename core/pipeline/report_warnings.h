// What a person should be told about a reconstruction beyond its figures.
#pragma once

#include <string>
#include <vector>

#include "core/pipeline/reconstruct.h"

namespace rilievo {

// Full sentences, the gravest first; empty when there is nothing to say.
std::vector<std::string> WarningsOf(const ReconstructReport& report);

}  // namespace rilievo
