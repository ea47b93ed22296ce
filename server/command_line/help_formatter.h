// --help in 80 columns.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace rilievo {

// CLI11's own, but with descriptions wrapped in their column, short placeholders instead of type
// names, and ranges and choices in the description.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
};

}  // namespace rilievo
