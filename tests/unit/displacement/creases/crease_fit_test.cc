#include "core/displacement/creases/crease_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

// Points about 0.01 apart of a height field around the origin, ascending by
// distance.
struct Patch {
  RayCloud cloud;
  std::vector<QueuedPoint> queue;
  Ray ray = MakeRay(Eigen::Vector3d::Zero(), {0, 0, 1});

  Patch(const std::function<double(double, double)>& height, double noise, int seed) {
    Random random(seed);
    const Points points = HeightFieldPoints(0.025, 25, &random, height);
    for (size_t i = 0; i < points.at.size(); ++i) {
      const Eigen::Vector3f p =
          (points.at[i] + noise * Gauss(&random) * points.normal[i]).cast<float>();
      const Eigen::Vector3f n = points.normal[i].cast<float>();
      cloud.points.push_back({{p[0], p[1], p[2]}, {n[0], n[1], n[2]}, 0.0113f, 0.0f});
      const float u = p.dot(ray.u), v = p.dot(ray.v);
      queue.push_back({static_cast<int>(i), u, v, p[2], u * u + v * v});
    }
    std::sort(queue.begin(), queue.end(), [](auto& a, auto& b) { return a.key < b.key; });
  }
  std::optional<CreaseFit> Fit(float noise = 0) const {
    return FitCrease(queue, cloud, ray, noise);
  }
};

TEST(CreaseFitTest, RidgesAndValleysAreExact) {
  for (const double slope : {0.2, 0.5, 1.0, 2.0}) {
    for (int seed = 0; seed < 10; ++seed) {
      const double offset = 0.0005 * seed;  // of the crease from the ray
      const auto ridge = [&](double x, double y) {
        return 0.01 - slope * std::abs(x + 0.3 * y - offset);
      };
      const auto fit = Patch(ridge, 0, seed).Fit();
      ASSERT_TRUE(fit.has_value()) << slope << " " << seed;
      EXPECT_NEAR(fit->height, ridge(0, 0), 1e-5);
      const auto valley = Patch([&](double x, double y) { return -ridge(x, y); }, 0, seed).Fit();
      ASSERT_TRUE(valley.has_value());
      EXPECT_NEAR(valley->height, -ridge(0, 0), 1e-5);
    }
  }
}

TEST(CreaseFitTest, TheCornerOfABoxIsExact) {
  // Three faces that meet at right angles in the point (0, 0, 0.002).
  const auto corner = [](double x, double y) {
    const double a = std::sqrt(2.0) * x, b = -std::sqrt(0.5) * x + std::sqrt(1.5) * y,
                 c = -std::sqrt(0.5) * x - std::sqrt(1.5) * y;
    return 0.002 - std::max({a, b, c});
  };
  int found = 0;
  for (int seed = 0; seed < 20; ++seed) {
    const auto fit = Patch(corner, 0, seed).Fit();
    if (!fit) continue;
    ++found;
    EXPECT_NEAR(fit->height, 0.002, 1e-4) << seed;
  }
  EXPECT_GE(found, 15);  // else a face got fewer than four points
}

TEST(CreaseFitTest, CurvedSurfacesAreLeftAlone) {
  for (int seed = 0; seed < 10; ++seed) {
    for (const double radius : {0.05, 0.1, 0.3}) {
      const auto sphere = [&](double x, double y) {
        return std::sqrt(radius * radius - x * x - y * y) - radius;
      };
      EXPECT_FALSE(Patch(sphere, 0, seed).Fit().has_value()) << radius;
      const auto saddle = [&](double x, double y) { return (x * x - y * y) / radius; };
      EXPECT_FALSE(Patch(saddle, 0, seed).Fit().has_value()) << radius;
    }
    EXPECT_FALSE(Patch([](double x, double) { return 0.3 * x; }, 0, seed).Fit().has_value());
  }
}

TEST(CreaseFitTest, NoiseIsNoCrease) {
  for (int seed = 0; seed < 20; ++seed) {
    EXPECT_FALSE(Patch([](double, double) { return 0.0; }, 0.001, seed).Fit(0.001f).has_value());
  }
}

TEST(CreaseFitTest, TooFewPointsSayNothing) {
  Patch patch([](double x, double) { return -std::abs(x); }, 0, 1);
  patch.queue.resize(6);
  EXPECT_FALSE(patch.Fit().has_value());
  patch.queue.clear();
  EXPECT_FALSE(patch.Fit().has_value());
}

}  // namespace
}  // namespace rilievo
