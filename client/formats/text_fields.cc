#include "client/formats/text_fields.h"

#include <algorithm>

namespace rilievo {
namespace {

constexpr std::string_view kFieldBlanks = " \t\r", kSeparators = " \t\r,;";

bool IsSpace(char c) { return c == ' ' || c == '\r'; }
bool IsSpaceOrTab(char c) { return IsSpace(c) || c == '\t'; }
bool IsCommaOrSemicolon(char c) { return c == ',' || c == ';'; }

}  // namespace

TextField NextField(std::string_view* line) {
  const auto end_of_line = line->end();
  const auto begin = std::find_if_not(line->begin(), end_of_line, IsSpace);
  const auto end = std::find_if(begin, end_of_line,
                                [](char c) { return IsSpaceOrTab(c) || IsCommaOrSemicolon(c); });
  TextField field{
      line->substr(static_cast<size_t>(begin - line->begin()), static_cast<size_t>(end - begin))};
  auto next = std::find_if_not(end, end_of_line, IsSpaceOrTab);
  if (next != end_of_line && IsCommaOrSemicolon(*next)) {
    const auto behind = std::find_if_not(next + 1, end_of_line, IsSpaceOrTab);
    field.gap = *next == ';'        ? FieldGap::kSemicolon
                : behind - end == 1 ? FieldGap::kComma
                                    : FieldGap::kSpacedComma;
    next = behind;
  } else if (const auto tab = std::find(end, next, '\t'); tab != next) {
    field.gap = FieldGap::kTab;
    next = std::find_if_not(tab + 1, next, IsSpace);
  } else if (next != end_of_line) {
    field.gap = FieldGap::kBlank;
  }
  line->remove_prefix(static_cast<size_t>(next - line->begin()));
  return field;
}

bool HasNoFields(std::string_view line) {
  return line.find_first_not_of(kSeparators) == std::string_view::npos;
}

std::optional<std::string_view> CommentIn(std::string_view line) {
  const auto without_blanks = [](std::string_view text) {
    return text.substr(std::min(text.find_first_not_of(kFieldBlanks), text.size()));
  };
  line = without_blanks(line);
  for (const std::string_view mark : {"#", "//", "%"}) {
    if (line.substr(0, mark.size()) == mark) return without_blanks(line.substr(mark.size()));
  }
  return std::nullopt;
}

}  // namespace rilievo
