#include "client/picture/edge_lines.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel_for.h"

namespace rilievo {
namespace {

constexpr float kRadius = 1.1f;    // samples
constexpr int kMostSteps = 65536;  // along one edge, however far its ends lie off the picture
const Eigen::Vector3f kInk(0.02f, 0.05f, 0.12f);

struct Rows {
  int begin, end;
};

// Samples within the radius of a place, unless something covers it.
void Dot(const Projected& place, float nearness, Rows rows, Raster* raster) {
  const int y_begin = std::max(rows.begin, static_cast<int>(std::floor(place.y - kRadius)));
  const int y_end = std::min(rows.end - 1, static_cast<int>(std::ceil(place.y + kRadius)));
  const int x_begin = std::max(0, static_cast<int>(std::floor(place.x - kRadius)));
  const int x_end = std::min(raster->width - 1, static_cast<int>(std::ceil(place.x + kRadius)));
  for (int y = y_begin; y <= y_end; ++y) {
    for (int x = x_begin; x <= x_end; ++x) {
      const float dx = static_cast<float>(x) + 0.5f - place.x;
      const float dy = static_cast<float>(y) + 0.5f - place.y;
      const size_t at = raster->at(x, y);
      if (dx * dx + dy * dy <= kRadius * kRadius && nearness >= raster->nearness[at]) {
        raster->color[at] = kInk;
      }
    }
  }
}

void Line(const Projected& a, const Projected& b, const Projection& projection, Rows rows,
          Raster* raster) {
  const auto [low, high] = std::minmax(a.y, b.y);
  if (!(high >= static_cast<float>(rows.begin) - kRadius &&
        low <= static_cast<float>(rows.end) + kRadius)) {
    return;
  }
  const float length = std::hypot(b.x - a.x, b.y - a.y);
  if (!std::isfinite(length)) return;
  const int steps = std::clamp(static_cast<int>(length) + 1, 1, kMostSteps);
  for (int i = 0; i <= steps; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(steps);
    const Projected place{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y),
                          a.nearness + t * (b.nearness - a.nearness)};
    if (!(std::abs(place.x) < 1e6f && std::abs(place.y) < 1e6f)) continue;
    Dot(place, projection.Nearer(place.nearness), rows, raster);
  }
}

}  // namespace

absl::Status DrawEdges(const TriangleMesh& mesh, const std::vector<Projected>& at,
                       const Projection& projection, const RunContext& context, Raster* raster) {
  return ParallelFor(raster->height, kRowBlock, context, [&](int64_t begin, int64_t end) {
    const Rows rows{static_cast<int>(begin), static_cast<int>(end)};
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int a = mesh.triangles(k, f), b = mesh.triangles((k + 1) % 3, f);
        Line(at[static_cast<size_t>(a)], at[static_cast<size_t>(b)], projection, rows, raster);
      }
    }
  });
}

}  // namespace rilievo
