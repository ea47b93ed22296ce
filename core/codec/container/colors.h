// Colours of the vertices in a .dss file: chunks `c` (docs/dss-format.md, section 5.8).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/loop/refinement.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// RMS error of coded colours that is asked for where nothing else is: 1 of 100, a ratio of peak
// signal to noise of 40 dB.
inline constexpr double kColorError = 0.01;

struct CodedColors {
  int64_t bytes = 0;  // that the file grew by; 0: there was no room
  double rms = 0;     // decoded against given colours, by area; full red, green or blue is 1
};

// Adds the colours of the surface, one a vertex, to the bytes that EncodeDss() made of it: each
// level's go behind its heights. They are coded in their principal axes, each like heights. Their
// RMS error is at most kColorError; it is larger where `max_bytes`, of all chunks together, asks
// for it, and where all that fit are no nearer than one colour for all there are none.
// INVALID_ARGUMENT when the colours are not those of the surface's vertices.
absl::StatusOr<CodedColors> AddColors(const DisplacedSurface& surface,
                                      std::optional<int64_t> max_bytes, const RunContext& context,
                                      EncodedSurface* encoded);

// The colours of the vertices of the finest level with heights. Levels whose colours are not there
// have means of the coarser ones; without any level the result is empty. `refinement` reaches that
// level but one. DATA_LOSS for a damaged chunk.
absl::StatusOr<std::vector<Rgb>> DecodeColors(const OpenedDss& file,
                                              const LoopRefinement& refinement,
                                              const RunContext& context);

// The same for a part of a surface with groups, see PartHeights. The colours of all its
// levels are there.
absl::StatusOr<std::vector<Rgb>> DecodePartOfColors(const OpenedDss& file,
                                                    const LoopRefinement& shared,
                                                    const std::vector<int>& part,
                                                    const LoopRefinement& refinement,
                                                    const RunContext& context);

}  // namespace rilievo
