// Heights of a .dss file made anew here and there, without touching the bytes that are there.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/open_dss.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

struct HeightUpdate {
  std::vector<uint8_t> told;  // one a vertex of the finest level: 1 where height and source are new
  std::vector<float> heights;         // same; what is not told is not looked at
  std::vector<HeightSource> sources;  // same
  double step = 0;  // of the quantiser at the finest level, fraction of the diagonal; (0, 0.01]
  std::string generator;  // program and version
};

// Whether a file takes an update. FAILED_PRECONDITION for one of an older version than 3, without
// its finest levels, or with kMostUpdates updates.
absl::Status CheckUpdatedFile(const OpenedDss& file);

// The chunk that makes a file of what is new, where it stands behind the whole file `dss`, which
// decodes to `before`. Groups without a height told anew take a few bytes in it. INVALID_ARGUMENT
// when numbers do not fit the surface; the errors of CheckUpdatedFile() and OpenDss().
absl::StatusOr<std::vector<uint8_t>> EncodeUpdate(std::span<const uint8_t> dss,
                                                  const DisplacedSurface& before,
                                                  const HeightUpdate& update,
                                                  const RunContext& context);

}  // namespace rilievo
