#include "core/displacement/local_fit/project_patch.h"

#include "core/base/wide_registers.h"

namespace rilievo {
namespace {

using Lanes = WideLanes;
using Stretch = WideStretch;
using Mask = int __attribute__((vector_size(kWideLanes * sizeof(int))));

// A normal at 60 degrees to the foot's has no weight.
constexpr float kNormalCutoff = 0.5f;
// Of another sheet, or of none: points steeper against the ray than this (rise over distance).
constexpr float kSteepest = 1.5f;

using MaskStretch =
    int __attribute__((vector_size(kWideLanes * sizeof(int)), aligned(alignof(int)), may_alias));

}  // namespace

RILIEVO_WIDE void ProjectPatch(const PatchPoints& points, const PatchView& view,
                               const SeenPoints& seen, int* inside) {
  const float *const from_x = points.position[0], *const from_y = points.position[1],
                     *const from_z = points.position[2];
  const float *const from_normal_x = points.normal[0], *const from_normal_y = points.normal[1],
                     *const from_normal_z = points.normal[2];
  // Copies: what is written through may_alias might else change them at every turn.
  const PatchView ray = view;
  const SeenPoints to = seen;
  Mask inside_lanes[kWindowCount] = {};
  for (int i = 0; i < points.count; i += kWideLanes) {
    const Lanes x = (*reinterpret_cast<const Stretch*>(from_x + i) - ray.origin[0]) * ray.scale;
    const Lanes y = (*reinterpret_cast<const Stretch*>(from_y + i) - ray.origin[1]) * ray.scale;
    const Lanes z = (*reinterpret_cast<const Stretch*>(from_z + i) - ray.origin[2]) * ray.scale;
    const Lanes normal_x = *reinterpret_cast<const Stretch*>(from_normal_x + i);
    const Lanes normal_y = *reinterpret_cast<const Stretch*>(from_normal_y + i);
    const Lanes normal_z = *reinterpret_cast<const Stretch*>(from_normal_z + i);
    const Lanes u = x * ray.u[0] + y * ray.u[1] + z * ray.u[2];
    const Lanes v = x * ray.v[0] + y * ray.v[1] + z * ray.v[2];
    const Lanes height =
        x * ray.direction[0] + y * ray.direction[1] + z * ray.direction[2] - ray.height * ray.scale;
    const Lanes turn = 1.0f - (normal_x * ray.foot_normal[0] + normal_y * ray.foot_normal[1] +
                               normal_z * ray.foot_normal[2]);
    Lanes keep = 1.0f - turn * (1.0f / kNormalCutoff);
    keep = keep > 0.0f ? keep : 0.0f;
    const Lanes square = u * u + v * v;
    Lanes excess = (height > 0.0f ? height : -height) - ray.sheet;
    excess = excess > 0.0f ? excess : 0.0f;
    const Lanes weight = excess * excess <= kSteepest * kSteepest * square ? keep * keep : Lanes{};
    const Mask weighs = weight > 0.0f;
    Mask window = {};
    for (int w = 0; w < kWindowCount; ++w) {
      const Mask is_inside = weighs & (square < 0.25f * kWindowSizes[w].points);
      window -= ~is_inside;
      inside_lanes[w] -= is_inside;
    }
    *reinterpret_cast<Stretch*>(to.u + i) = u;
    *reinterpret_cast<Stretch*>(to.v + i) = v;
    *reinterpret_cast<Stretch*>(to.height + i) = height;
    *reinterpret_cast<Stretch*>(to.square + i) = square;
    *reinterpret_cast<Stretch*>(to.weight + i) = weight;
    *reinterpret_cast<MaskStretch*>(to.window + i) = window;
  }
  for (int w = 0; w < kWindowCount; ++w) {
    inside[w] = 0;
    for (int lane = 0; lane < kWideLanes; ++lane) inside[w] += inside_lanes[w][lane];
  }
}

}  // namespace rilievo
