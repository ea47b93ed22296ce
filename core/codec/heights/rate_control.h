// The quantiser step that keeps a given error or number of bytes.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/height_encoder.h"

namespace rilievo {

// A step whose encoding has an RMS error of about `rms`, told by a few of its first rounds for a
// fraction of the time of encoding at several steps.
absl::StatusOr<double> FindStep(const HeightCoding& encoder, double rms, const RunContext& context);

// The coarsest quantiser found whose RMS error of the heights is at most `rms`: the search ends
// within 3 % of it, or after a dozen trials where the error is no smooth function of the step. None
// is finer than `least_step`, or 1e-8, or than what still helps: the error may then be larger.
absl::StatusOr<EncodedHeights> EncodeWithinError(const HeightCoding& encoder, double rms,
                                                 double least_step, const RunContext& context);

// The finest quantiser found whose layers take at most `bytes`, in the same way. `overhead` is
// added for every layer. RESOURCE_EXHAUSTED when even the coarsest one takes more.
absl::StatusOr<EncodedHeights> EncodeWithinBytes(const HeightCoding& encoder, int64_t bytes,
                                                 int64_t overhead, double least_step,
                                                 const RunContext& context);

}  // namespace rilievo
