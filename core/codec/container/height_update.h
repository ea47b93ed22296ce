// Heights that were made anew since a file was written: chunks `U` (docs/dss-format.md, section
// 5.9). What stood in the file before keeps its bytes.
#pragma once

#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/loop/refinement.h"
#include "core/surface/height_source.h"

namespace rilievo {

inline constexpr size_t kMostUpdates = 64;

// Bits of the first byte of the payload: all heights made anew that are not filled are smoothed;
// flags of smoothed ones, and of filled ones, are there.
inline constexpr int kAllSmoothedFlag = 1, kTellsSmoothedFlag = 2, kTellsFilledFlag = 4;

// Adds the differences of each update in order to the heights that are told anew, and gives these
// their sources; all others keep every bit. One entry a vertex of the finest level; `refinement`
// reaches the last level but one. Returns by which the last update changed each height; none where
// there are no updates. DATA_LOSS for a damaged chunk.
absl::StatusOr<std::vector<float>> ApplyUpdates(const OpenedDss& file,
                                                const LoopRefinement& refinement,
                                                const RunContext& context,
                                                std::vector<float>* heights,
                                                std::vector<HeightSource>* sources);

// The same for a part of a surface with groups, see PartHeights.
absl::Status ApplyUpdatesToPart(const OpenedDss& file, const LoopRefinement& shared,
                                const std::vector<int>& part, const LoopRefinement& refinement,
                                const RunContext& context, std::vector<float>* heights,
                                std::vector<HeightSource>* sources);

// Of the surface with its updates: the last of them says what chunk 0 can no longer say. DATA_LOSS
// for a damaged chunk.
absl::StatusOr<DssMetadata> MetadataWithUpdates(const OpenedDss& file);

}  // namespace rilievo
