// A run by parts that several processes share: who does which part, and what came of it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

// The steps of a run whose parts are functions of the pages, the options and what earlier steps
// have found, and of nothing else: whoever does them, their bytes are the same. Their numbers are
// kept by stores.
enum class PartStep {
  kLeftOut = 0,  // outliers and foliage, by run of pages; none where no points are thinned
  kCoarse,       // one part: the surface of the thinned points
  kSurfels,      // normals, spacings and noise, by run of pages
  kFit,          // control points, by control faces
  kHeights,      // heights, by control faces
  kUncoded,      // one part: how exactly the heights are worth coding; by the process that leads
  kCoded,        // one part: the layers of the file, not yet measured; by the process that leads
  kMeasured,     // what the file decodes to beside the points, by control faces
  kBlocks,       // a pass of coding over blocks of groups, between kUncoded and kCoded; its number
                 // follows, and those of the passes after it
};
inline constexpr int kMostPasses = 256;
inline constexpr int kMostPartSteps = static_cast<int>(PartStep::kBlocks) + kMostPasses;

// Whether the step is of one part in every run, for which all others wait.
constexpr bool IsOnePart(PartStep step) {
  return step == PartStep::kCoarse || step == PartStep::kUncoded || step == PartStep::kCoded;
}

// Whether the process that leads does it, and nobody else.
constexpr bool IsForLeader(PartStep step) {
  return step == PartStep::kUncoded || step == PartStep::kCoded;
}

// The next bytes, valid until the next call; none at the end.
using PieceSource = std::function<absl::StatusOr<std::span<const uint8_t>>()>;
using PieceSink = std::function<absl::Status(std::span<const uint8_t>)>;

// Used by one thread. An error ends the run: CANCELLED once nobody waits for it any longer.
class SharedParts {
 public:
  virtual ~SharedParts() = default;

  // Whether this process goes on to the surface once all parts are done; the others only help.
  virtual bool leads() const = 0;

  struct Turn {
    std::optional<int> part;  // to be done by this process; unset: all are done
    int done = 0;             // by all processes
  };
  // Waits while others do what is left of the `count` parts.
  virtual absl::StatusOr<Turn> Next(PartStep step, int count) = 0;

  // What came of the part that Next() gave.
  virtual absl::Status Keep(PartStep step, int part, const PieceSource& next) = 0;

  // What came of a part that is done.
  virtual absl::Status Fetch(PartStep step, int part, const PieceSink& take) = 0;
};

}  // namespace rilievo
