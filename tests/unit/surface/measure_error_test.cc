#include "core/surface/measure_error.h"

#include <algorithm>
#include <limits>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/surface/test_shapes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

TwoSidedError Measure(const Shape& a, const Shape& b, int samples = 20000) {
  MeasureOptions options;
  options.samples = samples;
  const auto error = MeasureTwoSided(a, b, options, RunContext());
  EXPECT_TRUE(error.ok()) << error.status();
  return *error;
}

TEST(MeasureTwoSidedTest, ConcentricSpheres) {
  const TwoSidedError error =
      Measure(SphereShape(1, 100, {3, -2, 5}), SphereShape(1.1, 100, {3, -2, 5}), 5000);
  // Chords of 1/100 of half a turn stand off their arcs by up to 1 - cos(pi / 200) = 1.2e-4.
  EXPECT_NEAR(error.rms, 0.1, 2e-4);
  EXPECT_NEAR(error.mean, 0.1, 2e-4);
  EXPECT_NEAR(error.p95, 0.1, 3e-4);
  EXPECT_NEAR(error.max, 0.1, 3e-4);
  EXPECT_NEAR(error.a_to_b.rms, error.b_to_a.rms, 3e-4);
  EXPECT_EQ(error.a_to_b.samples, 5000);
}

// Two squares over each other, shifted by dx along x and dz along z: within the overlap the
// distance is dz, on the strip that sticks out sqrt(dz^2 + s^2) with s uniform in [0, dx].
TEST(MeasureTwoSidedTest, ShiftedSquares) {
  const double dx = 0.2, dz = 0.1;
  Shape shifted = SquareShape(dz, 20);
  shifted.vertices.row(0).array() += dx;
  const TwoSidedError error = Measure(SquareShape(0, 20), shifted, 200000);
  const double mean_square = dz * dz + dx * dx * dx / 3;
  EXPECT_NEAR(error.rms, std::sqrt(mean_square), 4e-5);
  EXPECT_NEAR(error.a_to_b.rms, std::sqrt(mean_square), 4e-5);
  EXPECT_NEAR(error.max, std::sqrt(dz * dz + dx * dx), 1e-12);  // at vertices, so exactly
  // 95 % of the square lie within s = dx - 0.05.
  EXPECT_NEAR(error.p95, std::hypot(dz, 0.15), 2e-4);
}

TEST(MeasureTwoSidedTest, TheSameShapeHasNoError) {
  const Shape sphere = SphereShape(1, 40, {0, 0, 0});
  EXPECT_LT(Measure(sphere, sphere).max, 1e-12);
}

TEST(MeasureTwoSidedTest, PointSetsAreTakenAsTheyAre) {
  Shape points;
  points.vertices.resize(3, 3);
  points.vertices << 0.5, 0.25, 0.75,  //
      0.5, 0.5, 0.5,                   //
      1, 2, -3;
  const TwoSidedError error = Measure(points, SquareShape(0, 10));
  EXPECT_EQ(error.a_to_b.samples, 3);
  EXPECT_NEAR(error.a_to_b.mean, 2, 1e-12);
  EXPECT_NEAR(error.a_to_b.rms, std::sqrt(14 / 3.0), 1e-12);
  EXPECT_NEAR(error.a_to_b.max, 3, 1e-12);
  EXPECT_EQ(error.b_to_a.samples, 20000);
  EXPECT_GT(error.b_to_a.mean, 1);  // the square to the nearest point
}

// Points at the corners of a grid, dz under a square: their spacing is not an error across it.
TEST(MeasureTwoSidedTest, AcrossTheSurfaceTheSpacingOfPointsDoesNotCount) {
  Shape points = SquareShape(0, 20);
  points.triangles.resize(3, 0);
  EXPECT_EQ(Measure(SquareShape(0.001, 50), points).across_rms, -1);
  points.gaps.assign(points.vertices.cols(), 0.1f);
  const TwoSidedError error = Measure(SquareShape(0.001, 50), points);
  EXPECT_NEAR(error.across_rms, 0.001, 1e-12);
  EXPECT_GT(error.a_to_b.rms, 0.015);
  // The part of the square that no point is near to counts, by its whole distance: on the strip
  // from 0.5 to 1 that is x - 0.5, whose mean square is 1/12, half of the area.
  for (Eigen::Index i = 0; i < points.vertices.cols(); ++i) {
    if (points.vertices(0, i) > 0.5) points.vertices(0, i) = 0.5;
  }
  points.gaps.assign(points.vertices.cols(), 0.03f);
  EXPECT_NEAR(Measure(SquareShape(0, 50), points).across_rms, std::sqrt(1 / 24.0), 2e-3);
  // ... but not where that part was filled in.
  Shape square = SquareShape(0, 50);
  for (const auto vertex : square.vertices.colwise()) {
    square.filled.push_back(vertex[0] > 0.499 ? 1 : 0);
  }
  points.gaps.assign(points.vertices.cols(), 0.1f);
  const TwoSidedError seen = Measure(square, points);
  EXPECT_NEAR(seen.across_rms, 0, 1e-12);
  EXPECT_GT(seen.a_to_b.rms, 0.2);
  square.filled.pop_back();
  EXPECT_EQ(MeasureTwoSided(square, points, {}, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
  points.gaps.pop_back();
  EXPECT_EQ(MeasureTwoSided(SquareShape(0, 5), points, {}, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

// A roof whose sides meet at 90 degrees over the y axis; its points are 1/9 apart, and those of one
// side begin twice as far from the ridge.
TEST(MeasureTwoSidedTest, BesideASharpEdgeTheNearerSideCounts) {
  Shape roof = SquareShape(0, 20), points = SquareShape(0, 9);
  for (Shape* shape : {&roof, &points}) {
    const double shift = shape == &points ? 0.05 : 0;
    for (auto vertex : shape->vertices.colwise()) {
      const double down = vertex[0] - 0.5;  // along the roof, from the ridge
      const double x = (down > 0 ? shift + (1 - 2 * shift) * down : down) * std::sqrt(0.5);
      vertex = Eigen::Vector3d(x, vertex[1], -std::abs(x));
    }
  }
  points.triangles.resize(3, 0);
  points.gaps.assign(points.vertices.cols(), 0.3f);
  const double nearest_alone = Measure(roof, points).across_rms;
  EXPECT_GT(nearest_alone, 0.005);
  points.normals.resize(3, points.vertices.cols());
  for (Eigen::Index i = 0; i < points.vertices.cols(); ++i) {
    points.normals.col(i) =
        Eigen::Vector3d(points.vertices(0, i) < 0 ? 1 : -1, 0, -1).normalized();  // of either sign
  }
  EXPECT_LT(Measure(roof, points).across_rms, 0.2 * nearest_alone);
  // What lies off both sides counts as before.
  for (auto vertex : roof.vertices.colwise()) vertex[2] += 0.01;
  EXPECT_NEAR(Measure(roof, points).across_rms, 0.01 * std::sqrt(0.5), 1e-3);
  // A lip, one side that runs on beyond the ridge by three spacings, is no part of that side.
  Shape lip = SquareShape(0, 20);
  for (auto vertex : lip.vertices.colwise()) {
    const double down = -vertex[0] / 3;  // beyond the ridge
    vertex = Eigen::Vector3d(-down * std::sqrt(0.5), vertex[1], -down * std::sqrt(0.5));
  }
  EXPECT_GT(Measure(lip, points).across_rms, 0.08);
  points.normals.conservativeResize(3, points.vertices.cols() - 1);
  EXPECT_EQ(MeasureTwoSided(roof, points, {}, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

// One spike that area-weighted samples hardly see.
TEST(MeasureTwoSidedTest, TheMaximumSeesEveryVertex) {
  Shape spiked = SquareShape(0, 100);
  spiked.vertices(2, 50 * 101 + 50) = 0.5;
  const TwoSidedError error = Measure(spiked, SquareShape(0, 100), 1000);
  EXPECT_DOUBLE_EQ(error.a_to_b.max, 0.5);
  EXPECT_DOUBLE_EQ(error.max, 0.5);
  EXPECT_LT(error.a_to_b.mean, 0.01);
}

TEST(MeasureTwoSidedTest, AcrossTrianglesItIsTheLargerOfBothWays) {
  const TwoSidedError error = Measure(SquareShape(0.1, 5), SquareShape(0, 5));
  EXPECT_NEAR(error.across_rms, 0.1, 1e-12);
}

TEST(MeasureTwoSidedTest, SymmetricUnderExchange) {
  const Shape a = SphereShape(1, 30, {0, 0, 0}), b = SphereShape(0.9, 25, {0.05, 0, 0});
  const TwoSidedError ab = Measure(a, b), ba = Measure(b, a);
  EXPECT_EQ(ab.a_to_b.rms, ba.b_to_a.rms);
  EXPECT_EQ(ab.b_to_a.p95, ba.a_to_b.p95);
  EXPECT_EQ(ab.max, ba.max);
  EXPECT_DOUBLE_EQ(ab.rms, ba.rms);
  EXPECT_EQ(ab.p95, ba.p95);
}

TEST(MeasureTwoSidedTest, ScalesWithTheShapes) {
  Shape a = SphereShape(1, 30, {0, 0, 0}), b = SphereShape(0.9, 25, {0.05, 0, 0});
  const TwoSidedError unit = Measure(a, b);
  a.vertices = (a.vertices * 250).colwise() + Vector3d(500000, 4600000, 100);
  b.vertices = (b.vertices * 250).colwise() + Vector3d(500000, 4600000, 100);
  const TwoSidedError scaled = Measure(a, b);
  EXPECT_NEAR(scaled.rms, 250 * unit.rms, 250 * 2e-3 * unit.rms);
  EXPECT_NEAR(scaled.max, 250 * unit.max, 1e-6);
}

TEST(MeasureTwoSidedTest, ThreadsDoNotChangeTheResult) {
  const Shape a = SphereShape(1, 60, {0, 0, 0}), b = SphereShape(0.9, 50, {0.05, 0, 0});
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  MeasureOptions options;
  options.samples = 20000;
  const TwoSidedError x = *MeasureTwoSided(a, b, options, one);
  const TwoSidedError y = *MeasureTwoSided(a, b, options, two);
  EXPECT_EQ(x.rms, y.rms);
  EXPECT_EQ(x.mean, y.mean);
  EXPECT_EQ(x.p95, y.p95);
  EXPECT_EQ(x.max, y.max);
}

TEST(MeasureOneSidedTest, IsOneWayOfBoth) {
  const Shape a = SquareShape(0, 4), b = SquareShape(0.1, 7);
  const TwoSidedError both = *MeasureTwoSided(a, b, {}, RunContext());
  const DistanceSummary one = *MeasureOneSided(b, a, {}, RunContext());
  EXPECT_EQ(one.rms, both.b_to_a.rms);
  EXPECT_EQ(one.p95, both.b_to_a.p95);
  EXPECT_EQ(one.max, both.b_to_a.max);
  EXPECT_EQ(one.samples, both.b_to_a.samples);
  EXPECT_EQ(MeasureOneSided(a, Shape(), {}, RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(MeasureTwoSidedTest, ATreeThatIsThereChangesNothing) {
  const Shape a = SphereShape(1, 30, {0, 0, 0});
  const Shape b{SphereShape(1.1, 20, {0, 0.1, 0}).vertices, {}};
  const SearchableShape kept = MakeSearchable(b, RunContext()).value();
  for (int round = 0; round < 2; ++round) {
    const TwoSidedError with = MeasureAgainst(a, kept, {}, RunContext()).value();
    const TwoSidedError without = MeasureTwoSided(a, b, {}, RunContext()).value();
    EXPECT_EQ(with.rms, without.rms);
    EXPECT_EQ(with.p95, without.p95);
    EXPECT_EQ(with.a_to_b.max, without.a_to_b.max);
    EXPECT_EQ(with.b_to_a.mean, without.b_to_a.mean);
  }
  EXPECT_FALSE(MakeSearchable(Shape(), RunContext()).ok());
}

TEST(MeasureTwoSidedTest, NamesWhatIsWrong) {
  const Shape good = SquareShape(0, 4);
  const auto message = [](const Shape& a, const Shape& b, int samples) {
    MeasureOptions options;
    options.samples = samples;
    const absl::Status status = MeasureTwoSided(a, b, options, RunContext()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_THAT(message(Shape(), good, 1000), ::testing::HasSubstr("shape a is empty"));
  Shape bad = good;
  bad.vertices(1, 3) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(message(good, bad, 1000), ::testing::HasSubstr("shape b has a coordinate"));
  bad = good;
  bad.triangles(2, 1) = 25;
  EXPECT_THAT(message(good, bad, 1000), ::testing::HasSubstr("outside 0 to 24"));
  EXPECT_THAT(message(good, good, 999), ::testing::HasSubstr("measure.samples is 999"));
}

TEST(MeasureTwoSidedTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(MeasureTwoSided(SquareShape(0, 4), SquareShape(1, 4), {}, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
