// Text for a terminal of 80 columns.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace rilievo {

inline constexpr size_t kTextWidth = 80;

// Breaks `text` at blanks so that no line is wider than `width` (words longer than that excepted);
// lines after the first are indented by `indent`. No line end at the end.
std::string Wrap(std::string_view text, size_t indent, size_t width = kTextWidth);

// "  label     text...", the text wrapped in its own column, with a line end.
std::string LabelledLine(std::string_view label, std::string_view text);

// 1234567 as "1,234,567".
std::string Grouped(int64_t value);

// "1 face", "3 faces", "2 vertices": the count grouped.
std::string Counted(int64_t count, std::string_view one, std::string_view many);

// Three significant digits, no exponent between 0.0001 and 10 million.
std::string Short(double value);

// A share as "12.3 %"; never "0 %" for what is not 0.
std::string Percent(double share);

}  // namespace rilievo
