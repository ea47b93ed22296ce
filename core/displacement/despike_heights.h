// Heights that stand out of their surroundings like no surface does.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/height_samples.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {

struct Spike {
  int vertex;
  float expected;   // median height of its ring
  float tolerance;  // |height - expected| beyond this is a spike
};

// A vertex is a spike when it departs from the median of its ring by far more than its ring's own
// vertices depart from theirs, than the noise, and than half a local spacing. Steps of the surface
// are none: there the whole ring departs. Ascending by vertex.
absl::StatusOr<std::vector<Spike>> FindSpikes(const VertexRings& rings,
                                              const HeightSamples& samples,
                                              const RunContext& context);

}  // namespace rilievo
