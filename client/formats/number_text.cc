#include "client/formats/number_text.h"

#include <charconv>
#include <cmath>
#include <system_error>

#include "absl/strings/charconv.h"
#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

bool IsBlank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

absl::Status NotANumber(std::string_view token) {
  const bool decimal_comma = token.find_first_not_of("+-0123456789,eE") == std::string_view::npos &&
                             token.find(',') != std::string_view::npos;
  if (decimal_comma) {
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(token), " is not a number: a decimal comma? write a point, as in 0.5"));
  }
  return absl::InvalidArgumentError(absl::StrCat(Quoted(token), " is not a number"));
}

template <typename T>
void Append(T value, std::string* text) {
  char buffer[64];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof(buffer), value);
  text->append(buffer, static_cast<size_t>(end - buffer));
}

}  // namespace

absl::Status ParseNumber(std::string_view token, double* value) {
  std::string_view digits = token;
  if (!digits.empty() && digits.front() == '+') {
    digits.remove_prefix(1);
    if (!digits.empty() && digits.front() == '-') return NotANumber(token);
  }
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, *value);
  if (error == std::errc() && stop == end) return absl::OkStatus();
  if (error == std::errc::result_out_of_range && stop == end) {
    // std::from_chars does not tell too small from too large; this one does.
    double rounded = 0;
    absl::from_chars(digits.data(), end, rounded);
    if (std::abs(rounded) < 1) {
      *value = rounded;
      return absl::OkStatus();
    }
    return absl::InvalidArgumentError(
        absl::StrCat(Quoted(token), " is beyond the range of a double (1.8e308)"));
  }
  return NotANumber(token);
}

bool ParseCount(std::string_view token, uint64_t* value) {
  const char* end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(token.data(), end, *value);
  return !token.empty() && error == std::errc() && stop == end;
}

std::string_view NextWord(std::string_view* line) {
  size_t begin = 0;
  while (begin < line->size() && IsBlank((*line)[begin])) ++begin;
  size_t end = begin;
  while (end < line->size() && !IsBlank((*line)[end])) ++end;
  const std::string_view word = line->substr(begin, end - begin);
  line->remove_prefix(end);
  return word;
}

std::string_view WithoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  return text.substr(0, kMark.size()) == kMark ? text.substr(kMark.size()) : text;
}

std::string Quoted(std::string_view token) {
  std::string text = "'";
  for (char c : token.substr(0, 40)) text += c >= 32 && c < 127 ? c : '?';
  text += token.size() > 40 ? "...'" : "'";
  return text;
}

void AppendNumber(double value, std::string* text) { Append(value, text); }
void AppendNumber(float value, std::string* text) { Append(value, text); }
void AppendNumber(int64_t value, std::string* text) { Append(value, text); }

}  // namespace rilievo
