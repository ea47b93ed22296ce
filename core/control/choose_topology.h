// Which topology suits a cloud, when the caller leaves it open.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/build_control_mesh.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct TopologyChoice {
  Topology topology = Topology::kArbitrary;  // kPlanar, kSpherical or kArbitrary
  std::string reason;                        // one sentence
};

// Planar for an open cloud that is a height field of moderate slope over its plane, without steps
// that no point saw; spherical for one that certainly is closed and met once, and not too
// obliquely, by each ray from its centre; arbitrary for all else. Reads each point a few times: 0.5
// s for a million.
absl::StatusOr<TopologyChoice> ChooseTopology(const OrientedCloud& cloud,
                                              const RunContext& context);

}  // namespace rilievo
