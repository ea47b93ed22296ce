// The commands and their options as plain values: what completion and the manual are made from.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace rilievo {

struct OptionOutline {
  std::vector<std::string> names;  // "-o", "--output"; the name alone for a positional
  std::string placeholder;         // "FILE" in "--output FILE"; empty for flags
  std::vector<std::string> choices;
  std::string text;  // description with range and default
  bool positional = false, required = false, many = false;
  bool takes_value() const { return !placeholder.empty(); }
  bool takes_number() const { return placeholder == "N" || placeholder == "X"; }
};

struct CommandOutline {
  std::vector<std::string> path;  // {"jobs", "submit"}; empty for the program
  std::string text;
  std::vector<OptionOutline> options;
  std::vector<std::string> children;  // names of its own commands
};

// The program first, then its commands in order, each before its own. Hidden ones are left out.
std::vector<CommandOutline> OutlineOf(const CLI::App& program);

}  // namespace rilievo
