// The parts of one step of a run: some at a time, or shared with other processes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/paging/shared_parts.h"

namespace rilievo {

struct PartsOfStep {
  PartStep step = PartStep::kCoarse;
  int count = 0;
  // So many are made at once by a process that works alone. A part has stretches that one thread
  // does alone, and two parts of the size asked for fit into the memory that the coarse pass takes.
  int at_once = 2;
  // Returns the result of a part, which depends on the part alone. Called from several threads at
  // once, each with its own context.
  std::function<absl::StatusOr<std::vector<uint8_t>>(int part, const RunContext& context)> make =
      {};
  // Puts the result where this process looks for it. Called for one part at a time, in any order;
  // must not start threads, for a lock is held. INTERNAL if the bytes are not of such a part.
  std::function<absl::Status(int part, std::span<const uint8_t> bytes)> take = {};
  // Whether an earlier run of this process has left it there; empty: none has. Called while the
  // same lock is held as for `take`.
  std::function<bool(int part)> is_there = {};
};

// Whom a step tells of the share that is done, and who shares its parts; null: nobody.
struct PartsRun {
  std::function<void(double)> told;
  SharedParts* shared = nullptr;
};

// All parts are made, by whomever, and taken. What was measured is taken only by the process that
// leads. The errors of `make`, `take` and SharedParts.
absl::Status RunParts(const PartsOfStep& parts, const PartsRun& run, const RunContext& context);

// Of bytes that do not make sense.
absl::Status NotOfPart(PartStep step, int part);

}  // namespace rilievo
