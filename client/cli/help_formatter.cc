#include "client/cli/help_formatter.h"

#include "client/cli/text_layout.h"

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

// "INT:INT in [0 - 8]" means a placeholder N and the range "0 - 8".
std::string Placeholder(const std::string& type) {
  const std::string kind = type.substr(0, type.find(':'));
  if (kind == "INT" || kind == "UINT") return "N";
  if (kind == "FLOAT") return "X";
  return kind;
}

std::string Range(const std::string& type) {
  const size_t begin = type.find(" in [");
  if (begin == std::string::npos) return "";
  return " [" + type.substr(begin + 5, type.rfind(']') - begin - 5) + "]";
}

}  // namespace

HelpFormatter::HelpFormatter() { column_width(kColumn); }

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  std::string name = make_option_name(option, is_positional);
  std::string text = option->get_description();
  if (option->get_type_size() != 0) {
    const std::string type = option->get_type_name();
    if (!is_positional && !type.empty()) name += " " + Placeholder(type);
    text += Range(type);
  }
  if (!option->get_default_str().empty()) text += "; default " + option->get_default_str();
  return Row(name, text);
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return Row(command->get_name(), command->get_description());
}

}  // namespace rilievo
