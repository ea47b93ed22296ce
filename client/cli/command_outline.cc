#include "client/cli/command_outline.h"

#include <CLI/CLI.hpp>

#include "absl/strings/str_split.h"
#include "server/command_line/option_text.h"

namespace rilievo {
namespace {

// "TEXT:{auto,off}" means the choices auto and off.
std::vector<std::string> ChoicesOf(const std::string& type) {
  const size_t begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  return absl::StrSplit(type.substr(begin + 1, end - begin - 1), ',');
}

OptionOutline OutlineOf(const CLI::Option& option) {
  OptionOutline outline;
  outline.positional = option.get_positional();
  if (outline.positional) {
    outline.names = {option.get_name(true)};
  } else {
    for (const std::string& name : option.get_snames()) outline.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) outline.names.push_back("--" + name);
  }
  outline.placeholder = PlaceholderOf(option);
  outline.choices = ChoicesOf(option.get_type_name());
  outline.text = TextOf(option);
  outline.required = option.get_required();
  outline.many = option.get_items_expected_max() > 1;
  return outline;
}

void AppendOutline(const CLI::App& app, const std::vector<std::string>& path,
                   std::vector<CommandOutline>* commands) {
  CommandOutline outline{path, app.get_description(), {}, {}};
  for (const CLI::Option* option : app.get_options()) outline.options.push_back(OutlineOf(*option));
  const auto children = app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* child : children) {
    if (!child->get_group().empty()) outline.children.push_back(child->get_name());
  }
  commands->push_back(std::move(outline));
  for (const CLI::App* child : children) {
    if (child->get_group().empty()) continue;
    std::vector<std::string> below = path;
    below.push_back(child->get_name());
    AppendOutline(*child, below, commands);
  }
}

}  // namespace

std::vector<CommandOutline> OutlineOf(const CLI::App& program) {
  std::vector<CommandOutline> commands;
  AppendOutline(program, {}, &commands);
  return commands;
}

}  // namespace rilievo
