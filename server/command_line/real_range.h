// Ranges of real numbers for options.
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

namespace rilievo {

// `range` without the NaN that CLI11 lets through: it compares as neither below nor above.
inline CLI::Validator RealRange(const CLI::Range& range) {
  CLI::Validator real = range;
  real.operation([range](std::string& text) {
    double value = 0;
    if (CLI::detail::lexical_cast(text, value) && std::isnan(value)) {
      return text + " is not a number";
    }
    return range(text);
  });
  return real;
}

}  // namespace rilievo
