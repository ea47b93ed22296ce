#include "server/command_line/help_formatter.h"

#include "server/command_line/option_text.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

constexpr size_t kColumn = 26;

std::string Row(const std::string& name, const std::string& text) {
  std::string row = "  " + name;
  if (row.size() + 2 > kColumn) {
    row += '\n' + std::string(kColumn, ' ');
  } else {
    row.resize(kColumn, ' ');
  }
  // Wrapped as a paragraph of its own, then moved into the column.
  std::string paragraph = Wrap(text, 0, kTextWidth - kColumn);
  for (size_t at = 0; (at = paragraph.find('\n', at)) != std::string::npos; at += kColumn + 1) {
    paragraph.insert(at + 1, std::string(kColumn, ' '));
  }
  return row + paragraph + '\n';
}

}  // namespace

HelpFormatter::HelpFormatter() { column_width(kColumn); }

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  std::string name = make_option_name(option, is_positional);
  const std::string placeholder = PlaceholderOf(*option);
  if (!is_positional && !placeholder.empty()) name += " " + placeholder;
  return Row(name, TextOf(*option));
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return Row(command->get_name(), command->get_description());
}

}  // namespace rilievo
