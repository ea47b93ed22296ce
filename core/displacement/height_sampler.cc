#include "core/displacement/height_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/displacement/virtual_triangle.h"

namespace rilievo {
namespace {

// Share of the height in the key of the queue; see QueueGate.
constexpr float kHeightWeight = 0.25f;
// The queue is restarted from the hit while the hit lies farther off than this, in spacings.
constexpr float kRestartSpacings = 1.0f;
constexpr int kMostRestarts = 3;
// How steep the relief may be against the ray for points to enter the local fit.
constexpr float kFitSlope = 1.5f;
constexpr float kFitNoises = 5.0f;

// With normals that turn little over the triangle, the mean of the triangle and of the blended
// tangent planes of its corners: exact for quadrics, where the bare triangle cuts the corner by
// curvature * spacing^2 / 8.
float CurvedHeight(const VirtualTriangle& triangle, std::span<const QueuedPoint> queue,
                   const RayCloud& cloud, const Ray& ray) {
  constexpr float kLeastAgreement = 0.93f;
  constexpr float kLeastSlopeCosine = 0.35f;
  const RayPoint* corners[3];
  for (int k = 0; k < 3; ++k) corners[k] = &cloud.points[queue[triangle.corners[k]].point];
  for (int k = 0; k < 3; ++k) {
    const Eigen::Map<const Eigen::Vector3f> a(corners[k]->normal), b(corners[(k + 1) % 3]->normal);
    if (a.dot(b) < kLeastAgreement) return triangle.height;
  }
  float rise = 0;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Map<const Eigen::Vector3f> normal(corners[k]->normal);
    const float along = normal.dot(ray.direction);
    if (along < kLeastSlopeCosine) return triangle.height;
    const QueuedPoint& point = queue[triangle.corners[k]];
    rise += triangle.barycentric[k] * (normal.dot(ray.u) * point.u + normal.dot(ray.v) * point.v) /
            along;
  }
  return triangle.height + 0.5f * rise;
}

}  // namespace

HeightSampler::HeightSampler(const RayCloud& cloud, const NeighborGraph& graph,
                             const DisplacementOptions& options)
    : cloud_(cloud), options_(options), queue_(cloud, graph) {}

std::optional<HeightEstimate> HeightSampler::Pierce(const Ray& ray, int start, float reference) {
  QueueGate gate;
  gate.max_height = static_cast<float>(options_.max_height);
  gate.min_normal_agreement = static_cast<float>(options_.min_normal_agreement);
  gate.height_window = std::numeric_limits<float>::max();
  gate.height_weight = kHeightWeight;
  const float max_spacings = static_cast<float>(options_.max_triangle_spacings);
  std::optional<HeightEstimate> estimate;
  for (int round = 0; round < kMostRestarts; ++round) {
    gate.reference_height = reference;
    start = queue_.Walk(ray, gate, start);
    const float spacing = cloud_.points[start].spacing;
    queue_.Start(ray, gate, start);
    std::span<const QueuedPoint> queue = queue_.Sorted();
    auto triangle = FindVirtualTriangle(queue, cloud_, ray, max_spacings, reference);
    if (!triangle) {
      queue_.Grow(options_.max_queue, max_spacings * spacing);
      queue = queue_.Sorted();
      if (queue.size() > static_cast<size_t>(options_.max_queue)) {
        queue = queue.first(options_.max_queue);
      }
      triangle = FindVirtualTriangle(queue, cloud_, ray, max_spacings, reference);
    }
    if (!triangle) return estimate;
    const QueuedPoint& nearest = queue[triangle->corners[0]];
    const RayPoint& point = cloud_.points[nearest.point];
    float square = 0;
    for (float weight : triangle->barycentric) square += weight * weight;
    estimate = HeightEstimate{CurvedHeight(*triangle, queue, cloud_, ray),
                              point.noise * std::sqrt(square), point.spacing, nearest.point};
    if (std::abs(estimate->height - reference) <= kRestartSpacings * point.spacing) break;
    reference = estimate->height;
    start = nearest.point;
  }
  return estimate;
}

void HeightSampler::Fit(const Ray& ray, float noise, HeightEstimate* estimate) {
  QueueGate gate;
  gate.max_height = static_cast<float>(options_.max_height) + kFitNoises * noise;
  gate.min_normal_agreement = static_cast<float>(options_.min_normal_agreement);
  gate.reference_height = estimate->height;
  gate.height_window = kFitNoises * noise + 0.5f * estimate->spacing;
  gate.window_slope = kFitSlope;
  queue_.Start(ray, gate, estimate->foot);
  queue_.Grow(kMostFitPoints, std::numeric_limits<float>::max());
  const Eigen::Map<const Eigen::Vector3f> normal(cloud_.points[estimate->foot].normal);
  const auto fit = fitter_.Fit(queue_.Sorted(), cloud_, ray, normal, noise, estimate->height,
                               queue_.complete_radius());
  if (!fit) return;
  estimate->height = fit->height;
  estimate->deviation = fit->deviation;
}

std::optional<HeightEstimate> HeightSampler::Sample(const Ray& ray, const HeightBounds& bounds,
                                                    int start, float reference, bool always_fit) {
  auto estimate = Pierce(ray, start, reference);
  if (!estimate) return std::nullopt;
  const RayPoint& point = cloud_.points[estimate->foot];
  if (always_fit || point.noise > options_.plane_noise_ratio * point.spacing) {
    constexpr float kLeastNoiseShare = 0.05f;  // of the spacing, where a fit is asked for
    Fit(ray, std::max(point.noise, kLeastNoiseShare * point.spacing), &*estimate);
  }
  if (!(estimate->height >= bounds.lowest && estimate->height <= bounds.highest)) {
    return std::nullopt;
  }
  return estimate;
}

}  // namespace rilievo
