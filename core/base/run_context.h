// What every stage receives last: how to stop, whom to tell, how many threads, which seed.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>

#include "absl/status/status.h"

namespace rilievo {

// The stages of a reconstruction, in order.
enum class Stage {
  kCheck = 0,     // non-finite points, duplicates, degenerate sets
  kNeighbors,     // the k-nearest-neighbour graph
  kNormals,       // covariance normals, outliers, orientation
  kControlMesh,   // for one of four topologies
  kDomainFit,     // Loop surface fitted to the points
  kDisplacement,  // heights along the limit normals
  kMeasure,       // the two-sided error against the points
  kEncode,        // the .dss layers
};
inline constexpr int kStageCount = 8;

// Lower-case, hyphenated name of a stage, e.g. "control-mesh".
const char* StageName(Stage stage);

struct Progress {
  Stage stage;
  double fraction;  // of this stage, in [0, 1]
};

// Passed by const reference as the last argument of each stage. Copyable; a stage may call
// `progress` from the thread that called it, never from its workers.
struct RunContext {
  std::stop_token stop;                           // asked often; see CheckStop()
  std::function<void(const Progress&)> progress;  // may be empty
  int threads = 0;                                // 0: all hardware threads
  uint64_t seed = 0;                              // results depend on it and never on `threads`

  // CANCELLED once a stop was requested, else OK. Cheap: call it at least every 50 ms of work.
  absl::Status CheckStop() const;

  void Report(Stage stage, double fraction) const;

  // At least 1.
  int ThreadCount() const;
};

}  // namespace rilievo
