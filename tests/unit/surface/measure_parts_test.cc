// A surface measured in parts.
#include "core/surface/measure_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>

#include "core/surface/heights_in_memory.h"
#include "core/surface/surface_samples.h"
#include "tests/unit/surface/pages_in_memory.h"
#include "tests/unit/surface/test_shapes.h"
#include "tests/unit/surface/whole_folds.h"

namespace rilievo {
namespace {

constexpr int kLevel = 5;

// An octahedron, or its first faces, with heights of every source.
DisplacedSurface Rough(int faces) {
  DisplacedSurface surface;
  surface.control_mesh.vertices.resize(3, 6);
  surface.control_mesh.vertices << 0.3, -0.3, 0, 0, 0, 0, 0, 0, 0.3, -0.3, 0, 0, 0, 0, 0, 0, 0.3,
      -0.3;
  Eigen::Matrix3Xi octahedron(3, 8);
  octahedron << 0, 2, 1, 3, 2, 1, 3, 0, 2, 1, 3, 0, 0, 2, 1, 3, 4, 4, 4, 4, 5, 5, 5, 5;
  surface.control_mesh.faces = octahedron.leftCols(faces);
  if (faces < 8) surface.control_mesh.vertices.conservativeResize(3, 5);
  surface.max_level = kLevel;
  const MeshTopology topology = *BuildMeshTopology(
      surface.control_mesh.faces, static_cast<int>(surface.control_mesh.vertices.cols()));
  for (int64_t v = 0; v < VertexCountAt(topology, kLevel); ++v) {
    surface.heights.push_back(static_cast<float>(0.01 * CounterUnit(v)));
    surface.sources.push_back(static_cast<HeightSource>(v % 7 % 3));
  }
  return surface;
}

class InParts {
 public:
  explicit InParts(DisplacedSurface surface)
      : surface_(std::move(surface)),
        cutter_(PartCutter::Make(surface_.control_mesh).value()),
        heights_(surface_, cutter_.topology()),
        stored_(Stored(surface_, heights_)) {}

  const DisplacedSurface& surface() const { return surface_; }
  SurfaceParts Parts() const {
    const int faces = cutter_.topology().face_count();
    SurfaceParts parts;
    parts.count = (faces + 2) / 3;
    parts.area = 0.4;
    parts.triangles = [this, faces](int i, const RunContext& context) {
      std::vector<int> wanted;
      for (int f = 3 * i; f < std::min(faces, 3 * i + 3); ++f) wanted.push_back(f);
      return TrianglesOfPart(ReadPart(stored_, cutter_, wanted, 0).value(), context);
    };
    return parts;
  }

 private:
  DisplacedSurface surface_;
  PartCutter cutter_;
  HeightsInMemory heights_;
  StoredSurface stored_;
};

Shape WholeShape(const DisplacedSurface& surface) {
  TriangleMesh mesh = Tessellate(surface, surface.max_level, RunContext()).value();
  return {std::move(mesh.vertices), std::move(mesh.triangles)};
}

class PartTrianglesTest : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(ClosedAndOpen, PartTrianglesTest, ::testing::Values(8, 4));

TEST_P(PartTrianglesTest, AreThoseOfTheWhole) {
  DisplacedSurface surface = Rough(GetParam());
  for (float& height : surface.heights) height -= 0.6f;  // through the middle: turned over
  const InParts in_parts(std::move(surface));
  const Shape whole = WholeShape(in_parts.surface());
  const SurfaceParts parts = in_parts.Parts();
  Eigen::Index at = 0;
  for (int i = 0; i < parts.count; ++i) {
    const Shape part = parts.triangles(i, RunContext())->shape;
    for (const auto triangle : part.triangles.colwise()) {
      ASSERT_LT(at, whole.triangles.cols());
      for (int k = 0; k < 3; ++k) {
        ASSERT_LT(
            (part.vertices.col(triangle[k]) - whole.vertices.col(whole.triangles(k, at))).norm(),
            1e-12);
      }
      ++at;
    }
  }
  EXPECT_EQ(at, whole.triangles.cols());
  const PartsError counted = CountParts(parts, RunContext()).value();
  EXPECT_EQ(counted.folds, CountFolds(in_parts.surface()));
  EXPECT_GT(counted.folds, 0);
  for (const HeightSource source :
       {HeightSource::kMeasured, HeightSource::kSmoothed, HeightSource::kFilled}) {
    const std::vector<HeightSource>& sources = in_parts.surface().sources;
    EXPECT_EQ(counted.source_counts[static_cast<size_t>(source)],
              std::count(sources.begin(), sources.end(), source));
  }
}

// Points near the surface, far from it, and one in the middle, as far from all parts.
SearchableShape PointsAround() {
  Shape points;
  points.vertices.resize(3, 3000);
  for (int i = 0; i < 3000; ++i) {
    const double radius = i == 7 ? 0 : i % 500 == 0 ? 2 : 0.21 + 0.02 * CounterUnit(5 * i);
    points.vertices.col(i) = radius * CounterPoint(i + 100000).normalized();
  }
  points.gaps.assign(3000, 0.05f);
  return MakeSearchable(std::move(points), RunContext()).value();
}

// Part after part.
PartsError MeasureAll(const SurfaceParts& surface, PagesInMemory* pages) {
  const MeasureOptions options{20000};
  const RunContext context;
  pages->ForgetDistances();
  std::vector<MeasuredPart> measured(static_cast<size_t>(surface.count));
  for (int i = 0; i < surface.count; ++i) {
    measured[i] = MeasurePart(surface, i, options, context, *pages).value();
    EXPECT_TRUE(TakeDistances(&measured[i], pages).ok());
    // All parts together have as many as the scan.
    EXPECT_EQ(measured[i].squared_of_points.capacity(), 0U);
    EXPECT_EQ(measured[i].in_reach.capacity(), 0U);
  }
  return SumOfParts(surface, measured, context, pages).value();
}

TEST(MeasurePartsTest, ErrorsAreThoseOfTheWhole) {
  DisplacedSurface surface = Rough(8);
  surface.sources.assign(surface.sources.size(), HeightSource::kMeasured);
  const InParts in_parts(std::move(surface));
  const SearchableShape points = PointsAround();
  const Shape shape = WholeShape(in_parts.surface());
  const TwoSidedError whole =
      MeasureAgainst(shape, points, MeasureOptions{20000}, RunContext()).value();
  PagesInMemory pages(points.shape, 130);
  const auto measure = [&] { return MeasureAll(in_parts.Parts(), &pages).error; };
  const TwoSidedError parts = measure();
  EXPECT_NEAR(parts.b_to_a.rms, whole.b_to_a.rms, 1e-7 * whole.b_to_a.rms);
  EXPECT_NEAR(parts.b_to_a.mean, whole.b_to_a.mean, 1e-7 * whole.b_to_a.mean);
  EXPECT_NEAR(parts.b_to_a.p95, whole.b_to_a.p95, 1e-4 * whole.b_to_a.p95);
  EXPECT_NEAR(parts.p95, whole.p95, 0.02 * whole.p95);
  EXPECT_NEAR(parts.b_to_a.max, whole.b_to_a.max, 1e-7);
  EXPECT_EQ(measure().b_to_a.rms, parts.b_to_a.rms);
  EXPECT_EQ(parts.b_to_a.samples, 3000);
  EXPECT_NEAR(parts.a_to_b.max, whole.a_to_b.max, 1e-3 * whole.a_to_b.max);
  EXPECT_NEAR(parts.a_to_b.rms, whole.a_to_b.rms, 0.02 * whole.a_to_b.rms);
  EXPECT_NEAR(parts.a_to_b.mean, whole.a_to_b.mean, 0.02 * whole.a_to_b.mean);
  EXPECT_NEAR(parts.across_rms, whole.across_rms, 0.02 * whole.across_rms);
  EXPECT_NEAR(parts.rms, whole.rms, 0.02 * whole.rms);
}

// As when others measure some of the parts: whichever they are, and whatever was known before.
TEST(MeasurePartsTest, EachPartIsMeasuredByItself) {
  const InParts in_parts(Rough(8));
  const SurfaceParts surface = in_parts.Parts();
  const SearchableShape points = PointsAround();
  PagesInMemory pages(points.shape, 130);
  const PartsError together = MeasureAll(surface, &pages);
  const RunContext context;
  std::vector<MeasuredPart> measured(static_cast<size_t>(surface.count));
  for (int i = surface.count - 1; i >= 0; --i) {
    const PagesInMemory untouched(points.shape, 130);
    measured[i] = MeasurePart(surface, i, {20000}, context, untouched).value();
  }
  pages.ForgetDistances();
  for (MeasuredPart& part : measured) ASSERT_TRUE(TakeDistances(&part, &pages).ok());
  const PartsError apart = SumOfParts(surface, measured, context, &pages).value();
  EXPECT_EQ(apart.error.rms, together.error.rms);
  EXPECT_EQ(apart.error.across_rms, together.error.across_rms);
  EXPECT_EQ(apart.error.p95, together.error.p95);
  EXPECT_EQ(apart.error.max, together.error.max);
  EXPECT_EQ(apart.error.b_to_a.mean, together.error.b_to_a.mean);
  EXPECT_EQ(apart.folds, together.folds);
  EXPECT_EQ(apart.source_counts, together.source_counts);
}

TEST(MeasurePartsTest, NumbersThatAreNotOfAPartAreRefused) {
  const InParts in_parts(Rough(8));
  const SearchableShape points = PointsAround();
  PagesInMemory pages(points.shape, 130);
  const auto measured = MeasurePart(in_parts.Parts(), 0, {20000}, RunContext(), pages);
  ASSERT_FALSE(measured->pages.empty());
  ASSERT_FALSE(measured->squared.empty());
  const std::vector<std::function<void(MeasuredPart*)>> faults = {
      [&](MeasuredPart* part) { part->pages.back() = pages.count(); },
      [](MeasuredPart* part) { part->pages.front() = -1; },
      [](MeasuredPart* part) { part->in_reach.pop_back(); },
      [](MeasuredPart* part) { part->squared_of_points.pop_back(); },
      [](MeasuredPart* part) { part->squared_of_points.push_back(1); },
      [](MeasuredPart* part) { part->squared_of_points.back() = -1; },
      [](MeasuredPart* part) { part->squared_of_points.back() = NAN; },
      [](MeasuredPart* part) { part->squared.back() = -1; },
      [](MeasuredPart* part) { part->squared.back() = INFINITY; },
      [](MeasuredPart* part) { part->largest = NAN; },
      [](MeasuredPart* part) { part->across_sum = -INFINITY; },
      [](MeasuredPart* part) { part->across_count = -1; },
      [](MeasuredPart* part) { part->folds = int64_t{1} << 60; },
      [](MeasuredPart* part) { part->source_counts[1] = -1; },
      [](MeasuredPart* part) { part->box(1, 1) = NAN; },
  };
  for (size_t fault = 0; fault < faults.size(); ++fault) {
    MeasuredPart wrong = *measured;
    faults[fault](&wrong);
    EXPECT_EQ(TakeDistances(&wrong, &pages).code(), absl::StatusCode::kInternal) << fault;
  }
}

// All points on one side: what lies elsewhere finds them beyond the parts around it.
TEST(MeasurePartsTest, WhatHasNoPointsNearByFindsThoseFarOff) {
  DisplacedSurface surface = Rough(8);
  surface.sources.assign(surface.sources.size(), HeightSource::kMeasured);
  const InParts in_parts(std::move(surface));
  Shape all = PointsAround().shape, side;
  std::vector<int> kept;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d point = all.vertices.col(i);
    if (point.x() > 0.1 && point.norm() < 0.3) kept.push_back(i);
  }
  side.vertices = all.vertices(Eigen::all, kept);
  side.gaps.assign(kept.size(), 0.05f);
  const TwoSidedError whole =
      MeasureAgainst(WholeShape(in_parts.surface()), MakeSearchable(side, RunContext()).value(),
                     MeasureOptions{20000}, RunContext())
          .value();
  PagesInMemory pages(side, 50);
  const TwoSidedError parts = MeasureAll(in_parts.Parts(), &pages).error;
  EXPECT_GT(whole.a_to_b.max, 0.2);
  EXPECT_NEAR(parts.a_to_b.max, whole.a_to_b.max, 1e-9);
  EXPECT_NEAR(parts.a_to_b.rms, whole.a_to_b.rms, 0.01 * whole.a_to_b.rms);
  EXPECT_NEAR(parts.across_rms, whole.across_rms, 0.01 * whole.across_rms);
}

TEST(MeasurePartsTest, PointsAloneAskTheNearestPart) {
  const InParts in_parts(Rough(8));
  const SearchableShape points = PointsAround();
  const DistanceSummary whole =
      MeasureOneSided({points.shape.vertices, {}}, WholeShape(in_parts.surface()), {}, RunContext())
          .value();
  const DistanceSummary parts =
      MeasureToParts(points.shape.vertices, in_parts.Parts(), RunContext()).value();
  EXPECT_NEAR(parts.rms, whole.rms, 1e-12);
  EXPECT_NEAR(parts.max, whole.max, 1e-12);
}

TEST(SamplePieceTest, PiecesGetWhatTheirAreaIsWorth) {
  const Shape square = SquareShape(0, 10);
  std::vector<int> faces;
  const Eigen::Matrix3Xd even =
      SamplePiece(square.vertices, square.triangles, 1.0 / 2500, 1, &faces);
  EXPECT_NEAR(static_cast<double>(even.cols()), 2500, 1);
  EXPECT_EQ(static_cast<Eigen::Index>(faces.size()), even.cols());
  EXPECT_NEAR(even.row(0).mean(), 0.5, 0.01);
  EXPECT_NEAR(even.row(1).mean(), 0.5, 0.01);
  // Pieces smaller than a slice get as many together.
  Eigen::Index count = 0;
  for (uint64_t seed = 0; seed < 10000; ++seed) {
    count += SamplePiece(square.vertices, square.triangles, 4, seed, &faces).cols();
  }
  EXPECT_NEAR(static_cast<double>(count), 2500, 150);
}

}  // namespace
}  // namespace rilievo
