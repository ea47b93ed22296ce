#include "server/command_line/text_layout.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace rilievo {
namespace {

constexpr size_t kLabelWidth = 12;

// Wrap() with the first line starting at `column`.
std::string WrapFrom(std::string_view text, size_t column, size_t indent, size_t width) {
  std::string wrapped;
  bool at_line_start = true;
  const auto break_line = [&] {
    wrapped += '\n' + std::string(indent, ' ');
    column = indent;
    at_line_start = true;
  };
  while (!text.empty()) {
    const size_t end = std::min(text.find_first_of(" \n"), text.size());
    const std::string_view word = text.substr(0, end);
    if (!word.empty()) {
      if (!at_line_start && column + 1 + word.size() > width) break_line();
      if (!at_line_start) wrapped += ' ';
      column += word.size() + (at_line_start ? 0 : 1);
      wrapped += word;
      at_line_start = false;
    }
    if (end < text.size() && text[end] == '\n') break_line();
    text.remove_prefix(std::min(text.size(), end + 1));
  }
  return wrapped;
}

}  // namespace

std::string Wrap(std::string_view text, size_t indent, size_t width) {
  return WrapFrom(text, 0, indent, width);
}

std::string LabelledLine(std::string_view label, std::string_view text) {
  std::string head = "  ";
  head += label;
  head.resize(std::max(head.size() + 1, kLabelWidth + 2), ' ');
  return head + WrapFrom(text, head.size(), kLabelWidth + 2, kTextWidth) + '\n';
}

std::string Grouped(int64_t value) {
  std::string digits = std::to_string(value);
  const size_t first = value < 0 ? 1 : 0;
  for (size_t at = digits.size(); at > first + 3;) {
    at -= 3;
    digits.insert(at, 1, ',');
  }
  return digits;
}

std::string Counted(int64_t count, std::string_view one, std::string_view many) {
  return Grouped(count) + ' ' + std::string(count == 1 ? one : many);
}

std::string Short(double value) {
  const double size = std::abs(value);
  if (value == 0 || !std::isfinite(value)) return absl::StrFormat("%g", value);
  if (size < 1e-4 || size >= 1e7) return absl::StrFormat("%.2e", value);
  const int digits = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 7);
  return absl::StrFormat("%.*f", digits, value);
}

std::string Percent(double share) { return absl::StrCat(Short(100 * share), " %"); }

}  // namespace rilievo
