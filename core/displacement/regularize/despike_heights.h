// Heights that stand out of their surroundings like no surface does.
#pragma once

#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/rays/height_samples.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/level_rings.h"

namespace rilievo {

struct Spike {
  int vertex;
  float expected;   // height between the pair of opposite neighbours that it departs least from
  float tolerance;  // |height - expected| beyond this is a spike
};

// Whether the points contradict the height of a vertex. Called for few; calls run in parallel.
using ContradictedByPoints = absl::FunctionRef<bool(int vertex)>;

// A vertex departs from a pair of opposite neighbours by its height over their mean, and from its
// ring by the least of those: 0 on slopes and along the crest of an edge. On the rim of an open
// domain the two neighbours along it are such a pair, and the lines through the others tell its
// height as well, for a crest may end there. A vertex is a spike when it departs by far more than
// the vertices of its ring do from theirs, than their noise, and than a quarter of a local spacing;
// three times that where a crease told the height (samples.crease). A quarter of a spacing is
// enough where the points contradict the height. Ascending by vertex. `rings`: those of `finest`.
absl::StatusOr<std::vector<Spike>> FindSpikes(const MeshTopology& finest, const LevelRings& rings,
                                              const HeightSamples& samples,
                                              ContradictedByPoints contradicted,
                                              const RunContext& context);

}  // namespace rilievo
