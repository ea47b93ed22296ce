#include "client/picture/point_shading.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Eigen::Vector3f;

constexpr float kNone = -std::numeric_limits<float>::infinity();
constexpr int kRing[8][2] = {{2, 0}, {-2, 0}, {0, 2}, {0, -2}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};

// Heights towards the camera on a grid, in scaled units; kNone where nothing is.
struct DepthMap {
  int width, height;
  std::vector<float> z;
  size_t at(int x, int y) const { return static_cast<size_t>(y) * width + x; }
  float get(int x, int y) const {
    return x < 0 || y < 0 || x >= width || y >= height ? kNone : z[at(x, y)];
  }
};

template <typename Body>
absl::Status ForPixels(const Raster& raster, const RunContext& context, const Body& body) {
  return ParallelFor(raster.height, kRowBlock, context, [&](int64_t begin, int64_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < raster.width; ++x) body(x, y);
    }
  });
}

// Where most of the ring at `reach` is nearer by more than `step`, the ring's mean takes over.
absl::Status CloseGaps(int reach, float step, const RunContext& context, DepthMap* depth,
                       Raster* raster) {
  const DepthMap before = *depth;
  const std::vector<Vector3f> color_before = raster->color;
  return ForPixels(*raster, context, [&](int x, int y) {
    const size_t here = before.at(x, y);
    float sum = 0;
    int nearer = 0;
    Vector3f color = Vector3f::Zero();
    for (const auto& offset : kRing) {
      const int nx = x + offset[0] * reach / 2, ny = y + offset[1] * reach / 2;
      const float there = before.get(nx, ny);
      if (there == kNone || there < before.z[here] + step) continue;
      sum += there;
      color += color_before[before.at(nx, ny)];
      ++nearer;
    }
    if (nearer < 5) return;
    depth->z[here] = sum / static_cast<float>(nearer);
    raster->color[here] = color / static_cast<float>(nearer);
  });
}

// Mean along one axis over the samples of the same sheet: no further in depth than `step`.
absl::Status SmoothAlong(int dx, int dy, int reach, float step, const Raster& raster,
                         const RunContext& context, DepthMap* depth) {
  const DepthMap before = *depth;
  return ForPixels(raster, context, [&](int x, int y) {
    const float here = before.z[before.at(x, y)];
    if (here == kNone) return;
    float sum = 0, weights = 0;
    for (int k = -reach; k <= reach; ++k) {
      const float there = before.get(x + k * dx, y + k * dy);
      if (there == kNone || std::abs(there - here) > step) continue;
      const float weight = static_cast<float>(reach + 1 - std::abs(k));
      sum += weight * there;
      weights += weight;
    }
    depth->z[before.at(x, y)] = sum / weights;
  });
}

// Slope a sample along one axis, from the flatter side, so that a silhouette does not bend it.
float Slope(float before, float here, float after) {
  const bool has_before = before != kNone, has_after = after != kNone;
  if (!has_before && !has_after) return 0;
  if (!has_before) return after - here;
  if (!has_after) return here - before;
  return std::abs(after - here) < std::abs(here - before) ? after - here : here - before;
}

float CreaseShadow(const DepthMap& depth, int x, int y, int reach, float sample_size) {
  const float here = depth.z[depth.at(x, y)];
  float behind = 0;
  for (const auto& offset : kRing) {
    const float there = depth.get(x + offset[0] * reach, y + offset[1] * reach);
    if (there != kNone) behind += std::max(0.f, there - here);
  }
  const float slope = behind / (8 * 2 * static_cast<float>(reach) * sample_size);
  return std::exp(-0.45f * std::min(slope, 4.f));
}

}  // namespace

absl::Status ShadePoints(const Projection& projection, float radius, const RunContext& context,
                         Raster* raster) {
  DepthMap depth{raster->width, raster->height, raster->nearness};
  for (float& z : depth.z) {
    if (z != kNone) z = projection.HeightFromNearness(z);
  }
  const float sample_size = static_cast<float>(projection.scaled_units_per_sample());
  const int reach = std::max(2, static_cast<int>(std::lround(1.5f * radius)));
  const float step = 4 * static_cast<float>(reach) * sample_size;
  for (int round = 0; round < 2; ++round) {
    RILIEVO_RETURN_IF_ERROR(CloseGaps(reach * (round + 1), step, context, &depth, raster));
  }
  for (int round = 0; round < 3; ++round) {
    RILIEVO_RETURN_IF_ERROR(SmoothAlong(1, 0, reach, step, *raster, context, &depth));
    RILIEVO_RETURN_IF_ERROR(SmoothAlong(0, 1, reach, step, *raster, context, &depth));
  }
  return ForPixels(*raster, context, [&](int x, int y) {
    const size_t at = depth.at(x, y);
    const float here = depth.z[at];
    if (here == kNone) return;
    const Vector3f normal =
        Vector3f(-Slope(depth.get(x - 1, y), here, depth.get(x + 1, y)),
                 -Slope(depth.get(x, y + 1), here, depth.get(x, y - 1)), sample_size)
            .normalized();
    raster->color[at] = CreaseShadow(depth, x, y, reach, sample_size) *
                        Shade(raster->color[at], normal, Vector3f::UnitZ());
  });
}

}  // namespace rilievo
