#include "core/pipeline/keep_error.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/status_macros.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/coding_error.h"
#include "core/pipeline/stage_timer.h"

namespace rilievo {
namespace {

constexpr double kClose = 0.98;    // of the error asked for: bytes to be won above are not worth it
constexpr double kAim = 0.99;      // of it, between that and 1
constexpr double kNarrow = 1.015;  // bracket of coding errors that is not divided further
constexpr double kLeastFactor = 0.4, kMostFactor = 1.6;
constexpr double kFinestCoding = 1e-7, kCoarsestCoding = 0.1;  // EncodeOptions::max_error

double Squared(double x) { return x * x; }

size_t BytesOf(const EncodedSurface& encoded) {
  size_t bytes = 0;
  for (const auto& chunk : encoded.chunks) bytes += chunk.size();
  return bytes;
}

// Search over the RMS error that the heights are coded with. What coding adds to the mean square
// of the surface is about in proportion to the mean square of the heights' error.
class KeepSearch {
 public:
  KeepSearch(double limit, double own) : limit_(limit), own_(own) {}

  // The next coding error after `error` was measured with `coding`; 0 when the search is over.
  double Next(double coding, double error) {
    (error <= limit_ ? low_ : high_) = coding;
    if (error <= limit_ && error >= kClose * limit_) return 0;
    if (low_ > 0 && high_ > 0 && high_ < kNarrow * low_) return 0;
    const double aim = kAim * limit_;
    const double room = aim > own_ ? Squared(aim) - Squared(own_) : 0;
    // At least a quarter of the room that there is at all.
    const double wanted = std::max(room, 0.25 * (Squared(limit_) - Squared(own_)));
    const double added = Squared(error) - Squared(own_);
    const double factor =
        added > 0 ? std::clamp(std::sqrt(wanted / added), kLeastFactor, kMostFactor) : kMostFactor;
    const double next = coding * factor;
    const bool inside = (low_ == 0 || next > low_) && (high_ == 0 || next < high_);
    return inside ? next : std::sqrt(low_ * high_);
  }

 private:
  double limit_, own_;
  double low_ = 0, high_ = 0;  // kept, not kept
};

}  // namespace

absl::StatusOr<bool> KeepError(const OrientedCloud& cloud, const ReconstructOptions& options,
                               const RunContext& context, ReconstructReport* report,
                               CodedSurface* coded) {
  if (!options.encode.max_error || !options.measure) return true;
  const double limit = *options.encode.max_error, own = report->error.across_rms;
  if (own >= limit || !NoiseAllows(limit, *report)) return false;
  RunContext silent = context;  // progress has passed these stages
  silent.progress = nullptr;
  RILIEVO_ASSIGN_OR_RETURN(const SearchableShape points,
                           MakeSearchable(PointsToMeasure(cloud), silent));
  KeepSearch search(limit, own);
  double coding = CodingErrorWithin(limit, *report, options.measure);
  std::optional<EncodedSurface> kept;
  double kept_coding = 0;  // the coarsest that kept the error
  for (int round = 0; round < kKeepErrorRounds; ++round) {
    TwoSidedError error;
    {
      const StageTimer timer(Stage::kMeasure, silent, report);
      RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded,
                               DecodeDss(coded->encoded.Concatenate(), silent));
      RILIEVO_ASSIGN_OR_RETURN(error, MeasureSurface(decoded.surface, points, silent));
    }
    if (error.across_rms <= limit) {
      // Coarser than all coefficients at zero there is nothing.
      if (kept && coding > kept_coding && BytesOf(coded->encoded) >= BytesOf(*kept)) break;
      if (!kept || BytesOf(coded->encoded) < BytesOf(*kept)) kept = coded->encoded;
      kept_coding = std::max(kept_coding, coding);
    }
    double next = search.Next(coding, error.across_rms);
    if (next > 0) next = std::clamp(next, kFinestCoding, kCoarsestCoding);
    if (next == 0 || next == coding || round + 1 == kKeepErrorRounds) break;
    coding = next;
    RILIEVO_ASSIGN_OR_RETURN(coded->encoded,
                             RecodeSurface(*coded, coding, options, silent, report));
  }
  if (kept) coded->encoded = *std::move(kept);
  return kept.has_value();
}

}  // namespace rilievo
