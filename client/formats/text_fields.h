// The fields of a line of text: XYZ, CSV, trajectories.
#pragma once

#include <optional>
#include <string_view>

namespace rilievo {

// What separates a field from the next one. A comma is spaced where blanks stand beside it.
enum class FieldGap { kNone, kBlank, kTab, kComma, kSpacedComma, kSemicolon };

struct TextField {
  std::string_view text;
  FieldGap gap = FieldGap::kNone;
};

// Cuts the next field and the separator behind it off `line`. A comma, a semicolon or a tab
// separates two fields, whatever blanks stand around it: between two of them is an empty field, and
// "1,,3" has three. A run of blanks is one separator. Tabs beside a comma or semicolon are blanks.
TextField NextField(std::string_view* line);

// Whether the line holds blanks and separators alone.
bool HasNoFields(std::string_view line);

// The text behind the #, // or % in front, without the blanks between; nothing where the line is
// not a comment.
std::optional<std::string_view> CommentIn(std::string_view line);

}  // namespace rilievo
