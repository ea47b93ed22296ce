#include "core/pipeline/option_lengths.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/control/settings.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

// Fractions of the diagonal that the protocol allows too.
struct Range {
  double low, high;
};
const Range kMaxError{kOptionLengths.least_error, kOptionLengths.most_error},
    kHeightStep{kOptionLengths.least_step, kMaxStep};
const Range kRim{kControlOptions.shortest_rim, kControlOptions.longest_rim};
const Range kGap{kControlOptions.narrowest_gap, kControlOptions.widest_gap};

absl::Status CheckLength(const char* name, std::optional<double> length, bool has_fraction) {
  if (!length) return absl::OkStatus();
  if (has_fraction) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, " is given as a length, ", *length,
                     ", and as a fraction of the diagonal; leave one ", "of the two out"));
  }
  if (std::isfinite(*length) && *length > 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(name, " = ", *length, " as a length must be positive"));
}

absl::StatusOr<double> Fraction(const char* name, double length, double diagonal,
                                const Range& range) {
  const double fraction = length / diagonal;
  if (fraction >= range.low && fraction <= range.high) return fraction;
  return absl::InvalidArgumentError(
      absl::StrCat(name, ": ", length, " is ", 100 * fraction, " % of the diagonal, ", diagonal,
                   "; it must lie between ", range.low * diagonal, " and ", range.high * diagonal,
                   " (all in the unit of the coordinates)"));
}

}  // namespace

absl::Status OptionLengths::Validate(const ControlOptions& control,
                                     const EncodeOptions& encode) const {
  RILIEVO_RETURN_IF_ERROR(
      CheckLength("close_holes_below", close_holes_below, control.close_holes_below > 0));
  RILIEVO_RETURN_IF_ERROR(
      CheckLength("bridge_gaps_below", bridge_gaps_below, control.bridge_gaps_below > 0));
  RILIEVO_RETURN_IF_ERROR(CheckLength("max_error", max_error, encode.max_error.has_value()));
  RILIEVO_RETURN_IF_ERROR(CheckLength("height_step", height_step, encode.height_step > 0));
  if (max_error && encode.max_bytes) {
    return absl::InvalidArgumentError(
        "max_error and max_bytes cannot both be kept; leave one of them out");
  }
  return absl::OkStatus();
}

absl::StatusOr<ReconstructOptions> WithoutLengths(ReconstructOptions options, double diagonal) {
  const OptionLengths lengths = options.lengths;
  options.lengths = {};
  if (lengths.close_holes_below) {
    RILIEVO_ASSIGN_OR_RETURN(
        options.control.close_holes_below,
        Fraction("close_holes_below", *lengths.close_holes_below, diagonal, kRim));
  }
  if (lengths.bridge_gaps_below) {
    RILIEVO_ASSIGN_OR_RETURN(
        options.control.bridge_gaps_below,
        Fraction("bridge_gaps_below", *lengths.bridge_gaps_below, diagonal, kGap));
  }
  if (lengths.max_error) {
    RILIEVO_ASSIGN_OR_RETURN(options.encode.max_error,
                             Fraction("max_error", *lengths.max_error, diagonal, kMaxError));
  }
  if (lengths.height_step) {
    RILIEVO_ASSIGN_OR_RETURN(options.encode.height_step,
                             Fraction("height_step", *lengths.height_step, diagonal, kHeightStep));
  }
  return options;
}

}  // namespace rilievo
