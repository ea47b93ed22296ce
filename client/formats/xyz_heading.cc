#include "client/formats/xyz_heading.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

using std::string_view;

constexpr string_view kBlanks = " \t\r";

// By axis; the first of them that a heading has is taken.
constexpr std::array<std::array<string_view, 4>, 3> kAxisNames = {{
    {"x", "easting", "east", ""},
    {"y", "northing", "north", ""},
    {"z", "height", "elevation", "altitude"},
}};

string_view Trimmed(string_view text) {
  const size_t begin = text.find_first_not_of(kBlanks);
  if (begin == string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

// Where the first of `marks` is outside quotes.
size_t FindOutsideQuotes(string_view text, string_view marks) {
  char quote = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    if (quote != 0) {
      if (text[i] == quote) quote = 0;
    } else if (text[i] == '"' || text[i] == '\'') {
      quote = text[i];
    } else if (marks.find(text[i]) != string_view::npos) {
      return i;
    }
  }
  return string_view::npos;
}

// What separates the names: those of several words have something else than blanks between them.
// As of the numbers, commas and semicolons go before tabs.
string_view SeparatorsOf(string_view line) {
  for (const string_view marks : {",;", "\t"}) {
    if (FindOutsideQuotes(line, marks) != string_view::npos) return marks;
  }
  return kBlanks;
}

// The name without quotes and unit; empty for a unit alone.
string_view NameOf(string_view word) {
  word = Trimmed(word);
  if (word.size() >= 2 && (word.front() == '"' || word.front() == '\'') &&
      word.back() == word.front()) {
    word = Trimmed(word.substr(1, word.size() - 2));
  }
  return Trimmed(word.substr(0, word.find_first_of("[(")));
}

}  // namespace

std::optional<XyzHeading> ParseXyzHeading(string_view line) {
  const string_view separators = SeparatorsOf(line);
  constexpr int kNone = 4;
  std::array<int, 3> rank = {kNone, kNone, kNone};
  std::array<std::string, 3> names;
  XyzHeading heading;
  while (!line.empty()) {
    const size_t end = std::min(FindOutsideQuotes(line, separators), line.size());
    const string_view name = NameOf(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
    if (name.empty() && separators == kBlanks) continue;  // blanks in a row are one separator
    const std::string lower = absl::AsciiStrToLower(std::string(name));
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto& known = kAxisNames[axis];
      const int found =
          static_cast<int>(std::find(known.begin(), known.end(), lower) - known.begin());
      if (found >= rank[axis]) continue;
      rank[axis] = found;
      names[axis] = name;
      heading.axis_column[axis] = static_cast<int>(heading.names.size());
    }
    heading.names.push_back(lower);
  }
  while (!heading.names.empty() && heading.names.back().empty()) heading.names.pop_back();
  if (*std::max_element(rank.begin(), rank.end()) == kNone) return std::nullopt;
  heading.axis_names = absl::StrCat(names[0], ", ", names[1], ", ", names[2]);
  return heading;
}

}  // namespace rilievo
