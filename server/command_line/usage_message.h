// What is wrong with a command line, and what was probably meant.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace rilievo {

// Lines of at most 80 columns, the last of them the help page to look at. `error`: what
// program.parse() threw for `words`, the command line without the program's name.
std::string UsageMessage(const CLI::App& program, const std::vector<std::string>& words,
                         const CLI::ParseError& error);

// The one of `known` that differs from `word` by the fewest letters; empty when all differ by more
// than a third of them.
std::string Nearest(const std::string& word, const std::vector<std::string>& known);

}  // namespace rilievo
