#include "core/displacement/creases/crease_heights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/scans/random.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kPoints = 6000;
constexpr double kSlope = 0.8, kDepth = 0.004, kNoise = 0.008;

// A roof |x| < 0.5, |y| < 0.5 with its ridge along y, which noise has blurred the normals of.
OrientedCloud Roof(bool ridge) {
  Random random(11);
  OrientedCloud cloud = CloudOf(kPoints, std::hypot(1.0, kSlope), [&] {
    const double x = random.Uniform(-0.5, 0.5), y = random.Uniform(-0.5, 0.5);
    const double blurred = ridge ? kSlope * std::clamp(x / 0.03, -1.0, 1.0) : 0.0;
    const Vector3d true_normal = Vector3d(ridge ? std::copysign(kSlope, x) : 0, 0, 1).normalized();
    const Vector3d at(x, y, ridge ? -kSlope * std::abs(x) : 0);
    return std::pair<Vector3d, Vector3d>(at + kNoise * random.Normal() * true_normal,
                                         Vector3d(blurred, 0, 1).normalized());
  });
  cloud.noise.assign(cloud.noise.size(), static_cast<float>(kNoise));
  return cloud;
}

// A grid on that roof, kDepth below it along its normals, with a crease on the ridge.
struct Domain {
  static constexpr int kSide = 41, kRidge = kSide / 2;
  VertexRings rings;
  LimitSurface limit;
  SharpSectors sectors;
  std::vector<uint8_t> wanted;
  HeightSamples samples{kSide * kSide};  // nothing measured

  Domain() {
    Eigen::Matrix3Xi faces(3, 2 * (kSide - 1) * (kSide - 1));
    for (int y = 0, f = 0; y + 1 < kSide; ++y) {
      for (int x = 0; x + 1 < kSide; ++x) {
        const int v = y * kSide + x;
        faces.col(f++) << v, v + 1, v + kSide + 1;
        faces.col(f++) << v, v + kSide + 1, v + kSide;
      }
    }
    rings = BuildVertexRings(*BuildMeshTopology(faces, kSide * kSide));
    const Vector3d left = Vector3d(-kSlope, 0, 1).normalized();
    const Vector3d right = Vector3d(kSlope, 0, 1).normalized();
    limit.positions.resize(3, kSide * kSide);
    limit.normals.resize(3, kSide * kSide);
    limit.sector_normals.resize(3, 2 * kSide);
    wanted.assign(kSide * kSide, 0);
    for (int v = 0; v < kSide * kSide; ++v) {
      const double x = (v % kSide - kRidge) * 0.01, y = (v / kSide - kRidge) * 0.01;
      limit.positions.col(v) << x, y, -kSlope * std::abs(x) - kDepth * std::hypot(1, kSlope);
      limit.normals.col(v) = x < 0 ? left : x > 0 ? right : Vector3d::UnitZ();
      if (v % kSide != kRidge) continue;
      limit.sector_normals.col(sectors.size()) = left;
      limit.sector_normals.col(sectors.size() + 1) = right;
      sectors.vertices.insert(sectors.vertices.end(), {v, v});
      wanted[v] = 1;
    }
  }

  std::vector<CreaseHeight> Heights(const OrientedCloud& cloud) const {
    return HeightsBesideCreases(cloud, PointIndex(cloud.points), rings, limit, sectors, wanted,
                                samples, RunContext())
        .value();
  }
};

TEST(CreaseHeightsTest, BothFlanksComeOutThoughNormalsAreBlurred) {
  const Domain domain;
  double sum = 0, squares = 0, ridge = 0;
  int beside = 0, on = 0, before = -1;
  for (const auto& [vertex, estimate] : domain.Heights(Roof(true))) {
    EXPECT_GT(vertex, before);
    before = vertex;
    EXPECT_TRUE(estimate.fitted);
    const bool is_ridge = vertex % Domain::kSide == Domain::kRidge;
    EXPECT_EQ(estimate.crease, is_ridge);
    if (is_ridge) {
      ridge += estimate.height - kDepth * std::hypot(1, kSlope);
      ++on;
      continue;
    }
    const double off = estimate.height - kDepth;
    sum += off;
    squares += off * off;
    ++beside;
  }
  EXPECT_GT(on, Domain::kSide * 3 / 4);
  EXPECT_GT(beside, 4 * on);
  EXPECT_LT(std::abs(sum / beside), kNoise / 5);
  EXPECT_LT(std::sqrt(squares / beside), kNoise / 2);
  EXPECT_LT(std::abs(ridge / on), kNoise / 2);
}

TEST(CreaseHeightsTest, OnlyWhatIsAskedForAndNotFarAside) {
  Domain domain;
  std::fill(domain.wanted.begin(), domain.wanted.end(), 0);
  EXPECT_TRUE(domain.Heights(Roof(true)).empty());
  const int middle = Domain::kRidge * (Domain::kSide + 1);
  domain.wanted[middle] = 1;
  const auto heights = domain.Heights(Roof(true));
  EXPECT_FALSE(heights.empty());
  for (const CreaseHeight& height : heights) {
    const Vector3d way =
        domain.limit.positions.col(height.vertex) - domain.limit.positions.col(middle);
    EXPECT_LT(way.norm(), 0.12);
  }
}

// Their planes run on, the points do not.
TEST(CreaseHeightsTest, NothingIsToldWhereTheRoofHasEnded) {
  constexpr double kEnd = 0.05;
  OrientedCloud roof = Roof(true);
  for (int i = 0; i < kPoints; ++i) {
    if (roof.points(1, i) > kEnd) roof.points(1, i) = 2 * kEnd - roof.points(1, i);
  }
  const Domain domain;
  const auto heights = domain.Heights(roof);
  int before_end = 0;
  for (const CreaseHeight& height : heights) {
    const double y = domain.limit.positions(1, height.vertex);
    EXPECT_LT(y, kEnd + 0.04);
    before_end += y < kEnd;
  }
  EXPECT_GT(before_end, 100);
}

// A boss on a flank, too small to be seen in the fit of the sides.
TEST(CreaseHeightsTest, SidesAreNotBelievedWhereThePointsAroundAreOffThem) {
  const Domain domain;
  const Vector3d top(0.03, 0, -0.03 * kSlope);
  const auto told_there = [&](const OrientedCloud& roof) {
    int told = 0;
    for (const CreaseHeight& height : domain.Heights(roof)) {
      told += (domain.limit.positions.col(height.vertex) - top).norm() < 0.015;
    }
    return told;
  };
  OrientedCloud roof = Roof(true);
  EXPECT_GT(told_there(roof), 5);
  for (int i = 0; i < kPoints; ++i) {
    if ((roof.points.col(i) - top).norm() < 0.03) roof.points(2, i) += 4 * kNoise;
  }
  EXPECT_LT(told_there(roof), 3);
}

TEST(CreaseHeightsTest, FlatPointsTellNone) { EXPECT_TRUE(Domain().Heights(Roof(false)).empty()); }

TEST(CreaseHeightsTest, StopsWhenAsked) {
  const Domain domain;
  const OrientedCloud cloud = Roof(true);
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  EXPECT_EQ(HeightsBesideCreases(cloud, PointIndex(cloud.points), domain.rings, domain.limit,
                                 domain.sectors, domain.wanted, domain.samples, context)
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
