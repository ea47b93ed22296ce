// Numbers and words of text formats, the same in every locale.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace rilievo {

// Decimal floating point, a leading '+' allowed, nan and inf as C writes them. Numbers below the
// least double become 0. INVALID_ARGUMENT that quotes the token (shortened) and says what is wrong:
// no number, a decimal comma, or beyond the range of double.
absl::Status ParseNumber(std::string_view token, double* value);

// Digits only. False for a sign, a fraction, or more than `T` holds.
bool ParseCount(std::string_view token, uint64_t* value);

// Cuts the next run of non-blanks (blank, tab, CR, vertical tab, form feed) off `line`; empty at
// its end.
std::string_view NextWord(std::string_view* line);

// Without the UTF-8 mark that some programs put before the first line.
std::string_view WithoutByteOrderMark(std::string_view text);

// A token for a message: at most 40 characters, unprintable ones as '?'.
std::string Quoted(std::string_view token);

// The shortest text that reads back as the same double (or float).
void AppendNumber(double value, std::string* text);
void AppendNumber(float value, std::string* text);
void AppendNumber(int64_t value, std::string* text);

}  // namespace rilievo
