// An option of a command line as people read it.
#pragma once

#include <string>

namespace CLI {
class Option;
}

namespace rilievo {

// "N", "X", or the type's own name; empty for flags.
std::string PlaceholderOf(const CLI::Option& option);

// Description, range and default.
std::string TextOf(const CLI::Option& option);

}  // namespace rilievo
