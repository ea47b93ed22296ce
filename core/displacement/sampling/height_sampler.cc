#include "core/displacement/sampling/height_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/displacement/creases/crease_fit.h"
#include "core/displacement/rays/virtual_triangle.h"

namespace rilievo {
namespace {

// Share of the height in the key of the queue; see QueueGate.
constexpr float kHeightWeight = 0.25f;
// The queue is restarted from the hit while the hit lies farther off than this, in spacings.
constexpr float kRestartSpacings = 1.0f;
constexpr int kMostRestarts = 3;
// Rays whose hits lie within this many spacings of the first one's share its points, if their
// directions agree.
constexpr float kGroupSpacings = 2.5f;
constexpr float kGroupAgreement = 0.95f;
constexpr int kMostPatchPoints = 400;
constexpr int kCoveredRanks = 5;

// Points around the ray that a crease is fitted to.
constexpr int kCreasePoints = 17;
// Corners' normals apart by more than this: 1 - cos(5 degrees).
constexpr float kCreaseTurn = 0.0038f;

bool CornersTurn(const VirtualTriangle& triangle, std::span<const QueuedPoint> queue,
                 const RayCloud& cloud) {
  for (int k = 0; k < 3; ++k) {
    const Eigen::Map<const Eigen::Vector3f> a(
        cloud.points[queue[triangle.corners[k]].point].normal);
    const Eigen::Map<const Eigen::Vector3f> b(
        cloud.points[queue[triangle.corners[(k + 1) % 3]].point].normal);
    if (1 - a.dot(b) > kCreaseTurn) return true;
  }
  return false;
}

// How far the normals of the triangle's corners are those of one curved surface: on a circle they
// lean against each chord by as much at one end as at the other, so their sum has nothing along it;
// on a plane of which one normal leans, as beside a sharp edge, as much as their difference.
//
// Of that share, how much of the tangent planes' rise over the chord the surface takes: a circle
// whose ends turn by `a` lies R cos(a/2) deep in the chord and R / cos(a/2) in the tangents, so it
// takes c / (1 + c), c = cos(a/2): half where little turns.
float ShareOfRise(const std::array<const RayPoint*, 3>& corners) {
  // Normals that turn less, 21 degrees, lean for their own small errors.
  constexpr float kLittleTurn = 0.93f;
  float sums = 0, turns = 0, agreement = 1;
  for (int k = 0; k < 3; ++k) {
    const RayPoint &from = *corners[k], &to = *corners[(k + 1) % 3];
    const Eigen::Map<const Eigen::Vector3f> a(from.normal), b(to.normal);
    const Eigen::Vector3f chord = (Eigen::Map<const Eigen::Vector3f>(to.position) -
                                   Eigen::Map<const Eigen::Vector3f>(from.position))
                                      .normalized();
    const float sum = (a + b).dot(chord), turn = (b - a).dot(chord);
    sums += sum * sum;
    turns += turn * turn;
    agreement = std::min(agreement, a.dot(b));
  }
  if (agreement >= kLittleTurn) return 0.5f;
  const float half_turn = std::sqrt(std::max(0.0f, (1 + agreement) / 2));
  const float curved = turns > 0 ? std::clamp(1 - sums / turns, 0.0f, 1.0f) : 0;
  return curved * half_turn / (1 + half_turn);
}

// Between the triangle and the blended tangent planes of its corners, as far as these show
// curvature: exact for quadrics and for circles, where the bare triangle cuts the corner by
// curvature * spacing^2 / 8.
float CurvedHeight(const VirtualTriangle& triangle, std::span<const QueuedPoint> queue,
                   const RayCloud& cloud, const Ray& ray) {
  constexpr float kLeastAgreement = -0.5f;  // beyond, tangent planes meet far off
  constexpr float kLeastSlopeCosine = 0.35f;
  std::array<const RayPoint*, 3> corners;
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
  return triangle.height + ShareOfRise(corners) * rise;
}

// Middle height of the points nearest to the ray.
float MedianHeight(std::span<const QueuedPoint> queue) {
  constexpr int kMost = 9;
  std::array<float, kMost> heights;
  const int count = std::min(kMost, static_cast<int>(queue.size()));
  for (int i = 0; i < count; ++i) heights[i] = queue[i].height;
  std::nth_element(heights.begin(), heights.begin() + count / 2, heights.begin() + count);
  return heights[count / 2];
}

// The noise that a fit there is asked for with.
float FitNoise(const RayPoint& point) {
  constexpr float kLeastShare = 0.05f;  // of the spacing
  return std::max(point.noise, kLeastShare * point.spacing);
}

}  // namespace

bool IsNoisy(const RayPoint& point, const DisplacementOptions& options) {
  return point.noise > options.plane_noise_ratio * point.spacing;
}

float LeastNoiseWorthFitting(const DisplacementOptions& options) {
  constexpr double kShare = 1.0 / 3;
  return static_cast<float>(kShare * options.plane_noise_ratio);
}

bool IsWorthFitting(const RayPoint& point, const DisplacementOptions& options) {
  return point.noise > LeastNoiseWorthFitting(options) * point.spacing;
}

HeightSampler::HeightSampler(const RayCloud& cloud, const NeighborGraph& graph,
                             const DisplacementOptions& options)
    : cloud_(cloud), options_(options), queue_(cloud, graph) {}

std::optional<HeightEstimate> HeightSampler::PierceOnce(const Ray& ray, int start, QueueGate gate) {
  start = queue_.Walk(ray, start, &gate);
  TriangleRules rules;
  rules.max_spacings = static_cast<float>(options_.max_triangle_spacings);
  rules.reference_height = gate.reference_height;
  rules.noisy = IsNoisy(cloud_.points[start], options_);
  queue_.Start(ray, gate, start);
  std::span<const QueuedPoint> queue = queue_.Sorted();
  auto triangle = FindVirtualTriangle(queue, cloud_, ray, rules);
  if (!triangle) {
    queue_.Grow(options_.max_queue, rules.max_spacings * cloud_.points[start].spacing);
    queue = queue_.Sorted();
    if (queue.size() > static_cast<size_t>(options_.max_queue)) {
      queue = queue.first(options_.max_queue);
    }
    triangle = FindVirtualTriangle(queue, cloud_, ray, rules);
  }
  if (!triangle) return std::nullopt;
  if (rules.noisy) {
    // Noise tilts a triangle of its own size at will: the middle of a few points is safer.
    const RayPoint& point = cloud_.points[queue[0].point];
    return HeightEstimate{MedianHeight(queue), point.noise, point.spacing,
                          queue[0].point,      false,       true};
  }
  const QueuedPoint& nearest = queue[triangle->corners[0]];
  const RayPoint& point = cloud_.points[nearest.point];
  if (CornersTurn(*triangle, queue, cloud_)) {
    const size_t most = std::min<size_t>(queue.size(), kCreasePoints);
    const auto crease = FitCrease(queue.first(most), cloud_, ray, point.noise);
    if (crease) {
      return HeightEstimate{crease->height, crease->deviation, point.spacing, nearest.point, true,
                            false};
    }
  }
  float square = 0;
  for (float weight : triangle->barycentric) square += weight * weight;
  return HeightEstimate{CurvedHeight(*triangle, queue, cloud_, ray),
                        point.noise * std::sqrt(square),
                        point.spacing,
                        nearest.point,
                        false,
                        false};
}

std::optional<HeightEstimate> HeightSampler::Pierce(const Ray& ray, int start, float reference) {
  QueueGate gate;
  gate.max_height = static_cast<float>(options_.max_height);
  gate.min_normal_agreement = static_cast<float>(options_.min_normal_agreement);
  gate.height_window = std::numeric_limits<float>::max();
  gate.height_weight = kHeightWeight;
  std::optional<HeightEstimate> estimate;
  for (int round = 0; round < kMostRestarts; ++round) {
    gate.reference_height = reference;
    const auto next = PierceOnce(ray, start, gate);
    if (!next) break;
    estimate = next;
    if (std::abs(estimate->height - reference) <= kRestartSpacings * estimate->spacing) break;
    reference = estimate->height;
    start = estimate->foot;
  }
  return estimate;
}

void HeightSampler::FitGroup(std::span<const RaySample> samples, const RayGroup& group) {
  const RaySample& leader = samples[group.rays.front()];
  QueueGate gate;
  gate.max_height = std::numeric_limits<float>::max();
  gate.min_normal_agreement = static_cast<float>(options_.min_normal_agreement);
  gate.reference_height = leader.estimate.height;
  gate.height_window = std::numeric_limits<float>::max();
  gate.covered_ranks = kCoveredRanks;
  queue_.Start(leader.ray, gate, leader.estimate.foot);
  queue_.Grow(kMostPatchPoints, (kWidestFitSpacings + kGroupSpacings) * group.spacing);
  fitter_.SetPatch(queue_.queued(), cloud_);
  for (int member : group.rays) {
    const HeightEstimate& estimate = samples[member].estimate;
    const RayPoint& foot = cloud_.points[estimate.foot];
    const LocalFitRequest request = {Eigen::Map<const Eigen::Vector3f>(foot.normal),
                                     estimate.height, FitNoise(foot), foot.spacing,
                                     estimate.fitted ? 0 : estimate.deviation};
    fits_[member] = fitter_.FitScales(samples[member].ray, request);
  }
}

std::vector<RayGroup> HeightSampler::GroupRays(std::span<const RaySample> samples) {
  std::vector<RayGroup> groups;
  waiting_.clear();
  for (size_t i = 0; i < samples.size(); ++i) waiting_.push_back(static_cast<int>(i));
  while (!waiting_.empty()) {
    const RaySample& leader = samples[waiting_.front()];
    RayGroup group = {leader.ray.origin + leader.estimate.height * leader.ray.direction,
                      leader.ray.direction,
                      leader.estimate.spacing,
                      {}};
    const float reach = kGroupSpacings * group.spacing;
    size_t left = 0;
    for (int index : waiting_) {
      const RaySample& sample = samples[index];
      const Eigen::Vector3f hit = sample.ray.origin + sample.estimate.height * sample.ray.direction;
      const bool joins = (hit - group.position).squaredNorm() <= reach * reach &&
                         sample.ray.direction.dot(group.direction) > kGroupAgreement;
      if (joins) {
        group.rays.push_back(index);
      } else {
        waiting_[left++] = index;
      }
    }
    waiting_.resize(left);
    groups.push_back(std::move(group));
  }
  return groups;
}

void HeightSampler::Refine(std::span<RaySample> samples) {
  fits_.assign(samples.size(), {});
  const std::vector<RayGroup> groups = GroupRays(samples);
  for (const RayGroup& group : groups) FitGroup(samples, group);
  std::vector<ScaleLadder> ladders;
  ladders.reserve(fits_.size());
  for (const MultiscaleFit& view : fits_) ladders.push_back(view.ladder);
  const auto windows = SelectScalesTogether(ladders, groups);
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!windows[i]) continue;
    HeightEstimate& estimate = samples[i].estimate;
    const LocalFit fit = SelectFit(fits_[i], *windows[i]);
    // A fit less certain than the points it is made of reaches beyond them.
    if (fit.deviation > FitNoise(cloud_.points[estimate.foot])) continue;
    estimate.fitted |= fit.height != estimate.height;
    estimate.height = fit.height;
    estimate.deviation = fit.deviation;
  }
}

}  // namespace rilievo
