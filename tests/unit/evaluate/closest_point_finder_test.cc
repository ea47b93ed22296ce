#include "core/evaluate/closest_point_finder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/evaluate/relief_surfaces.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

ClosestPointFinder Finder(const DisplacedSurface& surface) {
  auto finder = ClosestPointFinder::Build(surface, RunContext());
  EXPECT_TRUE(finder.ok()) << finder.status();
  return *std::move(finder);
}

std::vector<ClosestPoint> Find(const ClosestPointFinder& finder, const Eigen::Matrix3Xd& places) {
  auto found = finder.Find(places, RunContext());
  EXPECT_TRUE(found.ok()) << found.status();
  return *std::move(found);
}

Eigen::Matrix3Xd PlacesAround(const DisplacedSurface& surface, int count) {
  testing::Random random(31);
  Eigen::Matrix3Xd places(3, count);
  for (int i = 0; i < count; ++i) {
    places.col(i) = surface.frame.ScanFromUnit(1.5 * random.Vector());
  }
  return places;
}

// How far the surface leaves the flat triangles, in the middles of their sides.
double MostBend(const DisplacedEvaluator& evaluator) {
  const int n = evaluator.triangles_along_side();
  double most = 0;
  for (int f = 0; f < evaluator.face_count(); ++f) {
    const auto point = [&](double i, double j) {
      return evaluator.At(f, i / n, j / n, JetOrder::kPosition).position;
    };
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i + j < n; ++i) {
        const Vector3d a = point(i, j), b = point(i + 1, j), c = point(i, j + 1);
        most = std::max({most, (point(i + 0.5, j) - (a + b) / 2).norm(),
                         (point(i, j + 0.5) - (a + c) / 2).norm(),
                         (point(i + 0.5, j + 0.5) - (b + c) / 2).norm()});
      }
    }
  }
  return most;
}

TEST(ClosestPointFinderTest, NoSampleIsNearer) {
  for (const auto& [name, surface] : testing::ReliefSurfaces()) {
    const ClosestPointFinder finder = Finder(surface);
    const Eigen::Matrix3Xd places = PlacesAround(surface, 200);
    const std::vector<ClosestPoint> found = Find(finder, places);
    std::vector<Vector3d> samples;
    constexpr int kSamples = 48;
    for (int f = 0; f < finder.evaluator().face_count(); ++f) {
      for (int j = 0; j <= kSamples; ++j) {
        for (int i = 0; i + j <= kSamples; ++i) {
          samples.push_back(
              finder.evaluator()
                  .At(f, double(i) / kSamples, double(j) / kSamples, JetOrder::kPosition)
                  .position);
        }
      }
    }
    const double bend = MostBend(finder.evaluator());
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      const ClosestPoint& at = found[static_cast<size_t>(i)];
      EXPECT_TRUE(finder.evaluator().Check(at.face, at.u, at.v).ok());
      const SurfaceJet jet = finder.evaluator().At(at.face, at.u, at.v, JetOrder::kPosition);
      EXPECT_EQ(jet.position, at.position);
      EXPECT_DOUBLE_EQ((places.col(i) - at.position).norm(), at.distance);
      double least = std::numeric_limits<double>::infinity();
      for (const Vector3d& sample : samples) {
        least = std::min(least, (places.col(i) - sample).norm());
      }
      // Two parts of the surface may be as near but for what it bends over a finest triangle.
      EXPECT_LT(at.distance, least + 2 * bend) << name << " place " << i;
    }
  }
}

// A place above a point of the surface, along its normal, has that point as its nearest.
TEST(ClosestPointFinderTest, FindsTheParameterOfAPointOnTheSurface) {
  for (const auto& [name, surface] : testing::ReliefSurfaces()) {
    const ClosestPointFinder finder = Finder(surface);
    testing::Random random(32);
    Eigen::Matrix3Xd places(3, 500);
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      double u = (random.Signed() + 1) / 2, v = (random.Signed() + 1) / 2;
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const int face = random.Below(finder.evaluator().face_count());
      places.col(i) = finder.evaluator().At(face, u, v, JetOrder::kPosition).position;
    }
    const std::vector<ClosestPoint> found = Find(finder, places);
    double worst = 0;
    for (const ClosestPoint& at : found) worst = std::max(worst, at.distance);
    EXPECT_LT(worst, 1e-9 * surface.frame.diagonal) << name;
  }
}

// Inside a face the way to the nearest point is perpendicular to the limit surface without relief.
TEST(ClosestPointFinderTest, FootsArePerpendicular) {
  const DisplacedSurface surface = testing::WithRelief(testing::Torus(8, 6), 2, 0);
  const ClosestPointFinder finder = Finder(surface);
  const Eigen::Matrix3Xd places = PlacesAround(surface, 500);
  const std::vector<ClosestPoint> found = Find(finder, places);
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    const ClosestPoint& at = found[static_cast<size_t>(i)];
    const SurfaceJet jet = finder.evaluator().At(at.face, at.u, at.v, JetOrder::kFirst);
    const Vector3d way = places.col(i) - at.position;
    EXPECT_LT(std::abs(way.dot(jet.u.normalized())), 1e-6 * way.norm() + 1e-9) << i;
    EXPECT_LT(std::abs(way.dot(jet.v.normalized())), 1e-6 * way.norm() + 1e-9) << i;
  }
}

// Outside of an edge of a cube the nearest points lie on the crease.
TEST(ClosestPointFinderTest, StopsAtCreases) {
  DisplacedSurface surface = testing::WithRelief(testing::SharpCube(), 2, 0);
  surface.frame = {};
  const ClosestPointFinder finder = Finder(surface);
  Eigen::Matrix3Xd places(3, 20);
  for (int i = 0; i < 20; ++i) places.col(i) << 1.5, 1.2 + 0.05 * i, -0.9 + 0.09 * i;
  const std::vector<ClosestPoint> found = Find(finder, places);
  for (int i = 0; i < 20; ++i) {
    const Vector3d expected(1, 1, places(2, i));
    EXPECT_LT((found[static_cast<size_t>(i)].position - expected).norm(), 1e-9) << i;
  }
}

TEST(ClosestPointFinderTest, DoesNotDependOnThreads) {
  const DisplacedSurface surface = testing::ReliefSurfaces()[1].surface;
  const ClosestPointFinder finder = Finder(surface);
  const Eigen::Matrix3Xd places = PlacesAround(surface, 5000);
  RunContext alone;
  alone.threads = 1;
  const auto one = finder.Find(places, alone);
  ASSERT_TRUE(one.ok()) << one.status();
  const std::vector<ClosestPoint> all = Find(finder, places);
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].face, (*one)[i].face);
    EXPECT_EQ(all[i].position, (*one)[i].position);
  }
}

TEST(ClosestPointFinderTest, NamesAPlaceThatIsNotFinite) {
  const ClosestPointFinder finder = Finder(testing::WithRelief(testing::Icosahedron(), 1, 0));
  Eigen::Matrix3Xd places = Eigen::Matrix3Xd::Zero(3, 2);
  places(1, 1) = std::nan("");
  const auto found = finder.Find(places, RunContext());
  EXPECT_EQ(found.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(found.status().message()), ::testing::HasSubstr("point 1"));
}

}  // namespace
}  // namespace rilievo
