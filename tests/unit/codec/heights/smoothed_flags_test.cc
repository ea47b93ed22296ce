#include "core/codec/heights/smoothed_flags.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/codec/heights/encode_smoothed_flags.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

constexpr int kFlagsLevel = 3;

struct Flags {
  LoopRefinement refinement;
  std::vector<uint8_t> filled, smoothed;
};

// `scatter`: share of the flags that are turned over.
Flags FlagsOn(const ControlMesh& mesh, double scatter) {
  const DisplacedSurface surface = SurfaceOver(mesh, kFlagsLevel, 4e-4, 1e-4);
  Flags flags;
  flags.refinement = *RefineTopology(surface.control_mesh, kFlagsLevel - 1, RunContext());
  for (size_t v = 0; v < surface.sources.size(); ++v) {
    const bool turned = std::abs(MixedUnit(v)) < scatter;
    flags.filled.push_back(surface.sources[v] == HeightSource::kFilled);
    flags.smoothed.push_back(flags.filled[v] == 0 &&
                             (surface.sources[v] == HeightSource::kSmoothed) != turned);
  }
  return flags;
}

std::vector<uint8_t> Encoded(const Flags& flags) {
  return *EncodeSmoothed(flags.refinement, kFlagsLevel, nullptr, flags.filled, flags.smoothed,
                         RunContext());
}

TEST(SmoothedFlagsTest, EveryFlagComesBack) {
  for (const double scatter : {0.0, 0.1, 0.5, 1.0}) {
    SCOPED_TRACE(scatter);
    const Flags flags = FlagsOn(Together(Torus(10, 8), Sheet(6, 7, true), {0, 0, 0.2}), scatter);
    const std::vector<uint8_t> payload = Encoded(flags);
    SmoothedReader reader = *SmoothedReader::Open(payload, 0);
    ASSERT_TRUE(reader.ReadShared(flags.refinement, kFlagsLevel + 1, flags.filled).ok());
    EXPECT_EQ(reader.shared(), flags.smoothed);
  }
}

// Of a flag that is turned with probability p, h(p) bits: 0.47 for one in ten.
TEST(SmoothedFlagsTest, ScatterCostsItsEntropy) {
  const Flags flags = FlagsOn(Torus(20, 16), 0.1);
  const auto known = std::count(flags.filled.begin(), flags.filled.end(), 0);
  const double bits = 8.0 * static_cast<double>(Encoded(flags).size());
  EXPECT_LT(bits, 0.47 * 1.35 * static_cast<double>(known));
  EXPECT_GT(bits, 0.47 * static_cast<double>(known));
}

// Whatever stands there, flags come out, one a vertex, or an error.
TEST(SmoothedFlagsTest, AnyBytesAreFlagsOrRefused) {
  const Flags flags = FlagsOn(Torus(10, 8), 0.5);
  int refused = 0;
  for (uint64_t trial = 0; trial < 50; ++trial) {
    std::vector<uint8_t> bytes(trial * 4);
    for (size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<uint8_t>(MixedBits(1000 * trial + i));
    }
    SmoothedReader reader = *SmoothedReader::Open(bytes, 0);
    const absl::Status status = reader.ReadShared(flags.refinement, kFlagsLevel + 1, flags.filled);
    if (!status.ok()) {
      EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
      ++refused;
      continue;
    }
    EXPECT_EQ(reader.shared().size(), flags.filled.size());
    EXPECT_LE(*std::max_element(reader.shared().begin(), reader.shared().end()), 1);
  }
  EXPECT_GT(refused, 0);
}

TEST(SmoothedFlagsTest, TheIndexOfGroupsIsChecked) {
  const ControlMesh mesh = *PrepareControlMesh(Torus(16, 9), 4e-4);
  Flags flags = FlagsOn(Torus(16, 9), 0.2);
  const MeshTopology& control = flags.refinement.levels[0];
  std::vector<GridPoint> points(control.vertex_count);
  for (int v = 0; v < control.vertex_count; ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      points[v][axis] = static_cast<int32_t>(std::lround(mesh.vertices(axis, v) / 4e-4));
    }
  }
  const FaceGroups groups = GroupFaces(control, points, kLeastGroupLimit);
  std::vector<uint8_t> payload = *EncodeSmoothed(flags.refinement, kFlagsLevel, &groups,
                                                 flags.filled, flags.smoothed, RunContext());
  ASSERT_TRUE(SmoothedReader::Open(payload, groups.count()).ok());
  EXPECT_FALSE(SmoothedReader::Open(payload, groups.count() + 1).ok());
  EXPECT_FALSE(SmoothedReader::Open(std::span(payload).first(3), groups.count()).ok());
  EXPECT_FALSE(
      SmoothedReader::Open(std::span(payload).first(payload.size() - 1), groups.count()).ok());
  for (int i = 0; i <= groups.count(); ++i) {
    payload[static_cast<size_t>(i)] ^= 1;
    EXPECT_EQ(SmoothedReader::Open(payload, groups.count()).status().code(),
              absl::StatusCode::kDataLoss);
    payload[static_cast<size_t>(i)] ^= 1;
  }
}

}  // namespace
}  // namespace rilievo
