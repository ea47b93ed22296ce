// Manual pages in the language of man(7), from the same descriptions as --help.
#pragma once

#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "client/cli/command_outline.h"

namespace rilievo {

// rilievo(1).
std::string ManualOfProgram(const std::vector<CommandOutline>& commands);

// rilievod(8), from what `rilievod --help` prints.
std::string ManualOfServer(absl::string_view help);

}  // namespace rilievo
