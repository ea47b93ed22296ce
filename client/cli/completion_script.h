// What a shell needs to complete the command line of `rilievo`.
#pragma once

#include <string>
#include <vector>

#include "client/cli/command_outline.h"

namespace rilievo {

// To be read by the shell itself: `source <(rilievo completion bash)`.
std::string BashCompletion(const std::vector<CommandOutline>& commands);
std::string ZshCompletion(const std::vector<CommandOutline>& commands);
std::string FishCompletion(const std::vector<CommandOutline>& commands);

}  // namespace rilievo
