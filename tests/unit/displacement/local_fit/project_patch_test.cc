#include "core/displacement/local_fit/project_patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "core/base/wide_registers.h"

namespace rilievo {
namespace {

constexpr PatchView kView = {.origin = {0.1f, -0.2f, 0.3f},
                             .u = {0.6f, 0.8f, 0},
                             .v = {-0.8f, 0.6f, 0},
                             .direction = {0, 0, 1},
                             .height = 0.05f,
                             .foot_normal = {0, 0.28f, 0.96f},
                             .scale = 12,
                             .sheet = 1.5f};

// Points around the ray, among them some that face away or lie on another sheet.
struct Patch {
  std::array<std::vector<float>, 3> position, normal;
  int count;

  explicit Patch(int points) : count(points) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> within(-0.6f, 0.6f), one(-1, 1);
    for (int i = 0; i < count + kWideLanes; ++i) {
      const float slope = one(random), rise = i % 5 == 0 ? one(random) : 0.1f * one(random);
      const std::array<float, 3> facing = {0, slope, i % 7 == 0 ? -1.0f : 1.0f};
      const float length = std::hypot(facing[1], facing[2]);
      for (int axis = 0; axis < 3; ++axis) {
        position[axis].push_back(kView.origin[axis] + (axis == 2 ? rise : within(random)));
        normal[axis].push_back(i < count ? facing[axis] / length : 0);
      }
    }
  }
};

struct Seen {
  std::vector<float> u, v, height, square, weight;
  std::vector<int> window;
  std::array<int, kWindowCount> inside;

  explicit Seen(const Patch& patch) {
    const int padded = patch.count + kWideLanes;
    for (std::vector<float>* array : {&u, &v, &height, &square, &weight}) array->resize(padded);
    window.resize(padded);
    const auto data = [](const std::array<std::vector<float>, 3>& of, int axis) {
      return of[axis].data();
    };
    ProjectPatch({{data(patch.position, 0), data(patch.position, 1), data(patch.position, 2)},
                  {data(patch.normal, 0), data(patch.normal, 1), data(patch.normal, 2)},
                  patch.count},
                 kView,
                 {u.data(), v.data(), height.data(), square.data(), weight.data(), window.data()},
                 inside.data());
  }
};

// One point after the other, by the same operations in the same order: whatever registers the
// machine has, not one bit may differ where the compiler fuses none of them.
TEST(ProjectPatchTest, EachPointIsSeenAsByItself) {
  for (const int count : {0, 1, 7, 8, 9, 250}) {
    const Patch patch(count);
    const Seen seen(patch);
    std::array<int, kWindowCount> inside = {};
    int without_weight = 0;
    for (int i = 0; i < count; ++i) {
      SCOPED_TRACE(i);
      const float x = (patch.position[0][i] - kView.origin[0]) * kView.scale,
                  y = (patch.position[1][i] - kView.origin[1]) * kView.scale,
                  z = (patch.position[2][i] - kView.origin[2]) * kView.scale;
      const auto along = [&](const float* axis) { return x * axis[0] + y * axis[1] + z * axis[2]; };
      const float u = along(kView.u), v = along(kView.v);
      const float height = along(kView.direction) - kView.height * kView.scale;
      const float square = u * u + v * v;
      const float facing = patch.normal[0][i] * kView.foot_normal[0] +
                           patch.normal[1][i] * kView.foot_normal[1] +
                           patch.normal[2][i] * kView.foot_normal[2];
      const float keep = std::max(0.0f, 1 - (1 - facing) * 2);
      const float excess = std::max(0.0f, std::abs(height) - kView.sheet);
      const float weight = excess * excess <= 2.25f * square ? keep * keep : 0;
      EXPECT_FLOAT_EQ(seen.u[i], u);
      EXPECT_FLOAT_EQ(seen.v[i], v);
#if defined(__x86_64__)
      EXPECT_EQ(seen.u[i], u);
      EXPECT_EQ(seen.v[i], v);
      EXPECT_EQ(seen.height[i], height);
      EXPECT_EQ(seen.square[i], square);
      EXPECT_EQ(seen.weight[i], weight);
#endif
      int window = kWindowCount;
      for (int w = kWindowCount - 1; w >= 0; --w) {
        if (!(weight > 0 && square < 0.25f * kWindowSizes[w].points)) continue;
        window = w;
        ++inside[w];
      }
      EXPECT_EQ(seen.window[i], window);
      without_weight += weight == 0;
    }
    EXPECT_EQ(seen.inside, inside);
    if (count > 100) {
      EXPECT_GT(without_weight, count / 10);
      EXPECT_GT(inside[0], 0);
      EXPECT_LT(inside[0], inside[kWindowCount - 1]);
    }
  }
}

}  // namespace
}  // namespace rilievo
