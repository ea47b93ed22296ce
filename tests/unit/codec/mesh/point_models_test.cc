#include "core/codec/mesh/point_models.h"

#include <Eigen/Geometry>

#include "core/codec/bytes/range_coder.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

GridPoint RandomPoint(uint64_t at, int32_t size) {
  GridPoint point;
  for (int axis = 0; axis < 3; ++axis) {
    point[axis] = static_cast<int32_t>(size * MixedUnit(3 * at + axis));
  }
  return point;
}

template <typename Model>
void ExpectRoundTrip(const Model& fresh, int32_t size, bool degenerate) {
  RangeEncoder encoder;
  Model writer = fresh;
  const auto gate_of = [&](uint64_t i) {
    PointGate gate;
    gate.seed = i < 3;
    gate.start = RandomPoint(4 * i, size);
    gate.end = degenerate ? gate.start : RandomPoint(4 * i + 1, size);
    gate.apex = degenerate ? gate.start : RandomPoint(4 * i + 2, size);
    return gate;
  };
  constexpr int kCount = 300;
  for (int i = 0; i < kCount; ++i) {
    const GridPoint point = RandomPoint(4 * i + 3, size);
    EXPECT_EQ(writer.Code(encoder, point, gate_of(i)), point);
  }
  const std::vector<uint8_t> bytes = encoder.Finish();
  RangeDecoder decoder(bytes);
  Model reader = fresh;
  for (int i = 0; i < kCount; ++i) {
    EXPECT_EQ(reader.Code(decoder, GridPoint{}, gate_of(i)), RandomPoint(4 * i + 3, size)) << i;
  }
  EXPECT_FALSE(decoder.overrun());
}

TEST(PointModelsTest, RoundTripsPointsOfEverySize) {
  for (int32_t size : {0, 1, 7, 1000, kMaxCoordinate}) {
    for (bool degenerate : {false, true}) {
      ExpectRoundTrip(PointModel(10), size, degenerate);
      ExpectRoundTrip(PointModelV1(), size, degenerate);
    }
  }
}

// Points near the plane of their gate's face, whatever its attitude, cost fewer bits along the
// normal: so much a point as the ratio of the two lengths, less what is lost to the three axes.
TEST(PointModelsTest, ThePlaneOfTheGateSavesBits) {
  const auto bits = [](double off_plane) {
    RangeEncoder encoder;
    PointModel model(10);
    constexpr int kCount = 3000;
    for (int i = 0; i < kCount; ++i) {
      const Eigen::Vector3d u =
          Eigen::Vector3d(MixedUnit(9 * i), MixedUnit(9 * i + 1), MixedUnit(9 * i + 2))
              .normalized();
      const Eigen::Vector3d w(MixedUnit(9 * i + 3), MixedUnit(9 * i + 4), MixedUnit(9 * i + 5));
      const Eigen::Vector3d n = u.cross(w).normalized(), v = n.cross(u);
      const auto grid = [](const Eigen::Vector3d& p) {
        return GridPoint{static_cast<int32_t>(p[0]), static_cast<int32_t>(p[1]),
                         static_cast<int32_t>(p[2])};
      };
      const PointGate gate = {false, {0, 0, 0}, grid(1000 * u), grid(500 * u + 866 * v)};
      const Eigen::Vector3d point = 500 * u - 866 * v + 300 * MixedUnit(9 * i + 6) * u +
                                    300 * MixedUnit(9 * i + 7) * v +
                                    off_plane * MixedUnit(9 * i + 8) * n;
      model.Code(encoder, grid(point), gate);
    }
    return 8.0 * encoder.Finish().size() / kCount;
  };
  EXPECT_GT(bits(300) - bits(20), 2.0);  // log2(15) = 3.9 at best, lengths below 1/32 are all one
}

}  // namespace
}  // namespace rilievo
