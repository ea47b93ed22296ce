#include "server/command_line/option_text.h"

#include <CLI/CLI.hpp>

namespace rilievo {
namespace {

// "INT:INT in [0 - 8]" means a placeholder N and the range "0 - 8".
std::string RangeOf(const std::string& type) {
  const size_t begin = type.find(" in [");
  if (begin == std::string::npos) return "";
  return " [" + type.substr(begin + 5, type.rfind(']') - begin - 5) + "]";
}

}  // namespace

std::string PlaceholderOf(const CLI::Option& option) {
  if (option.get_type_size() == 0) return "";
  const std::string type = option.get_type_name();
  const std::string kind = type.substr(0, type.find(':'));
  if (kind == "INT" || kind == "UINT") return "N";
  if (kind == "FLOAT") return "X";
  return kind;
}

std::string TextOf(const CLI::Option& option) {
  std::string text = option.get_description();
  if (option.get_type_size() != 0) text += RangeOf(option.get_type_name());
  if (!option.get_default_str().empty()) text += "; default " + option.get_default_str();
  return text;
}

}  // namespace rilievo
