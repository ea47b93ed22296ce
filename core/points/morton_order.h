// The order along a Morton (Z) curve: neighbours in space lie close in memory.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"

namespace rilievo {

// Bits of each axis in a Morton code.
inline constexpr int kMortonBits = 21;

// The cell along one axis of a coordinate in [-0.5, 0.5] (clamped): [0, 2^21).
uint32_t MortonCell(double coordinate);

// Interleaves three cells, x in the lowest bit.
uint64_t MortonCode(uint32_t x, uint32_t y, uint32_t z);

struct MortonOrder {
  std::vector<int> order;       // column of `points` at each place of the curve
  std::vector<uint64_t> codes;  // by place, ascending
};

// `points`: unit frame. Points in one cell are ordered by x, y, z and at last by column, so the
// order of distinct points does not depend on the order they came in. CANCELLED when stopped.
absl::StatusOr<MortonOrder> ComputeMortonOrder(const Eigen::Matrix3Xd& points,
                                               const RunContext& context);

}  // namespace rilievo
