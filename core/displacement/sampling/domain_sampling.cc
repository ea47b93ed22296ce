#include "core/displacement/sampling/domain_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/displacement/creases/crease_heights.h"
#include "core/displacement/creases/side_heights.h"
#include "core/displacement/regularize/contradicts_points.h"
#include "core/displacement/regularize/despike_heights.h"
#include "core/displacement/regularize/predict_heights.h"
#include "core/loop/split_normals.h"
#include "core/points/point_support.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 512;
constexpr int64_t kRaysPerTask = 128;
constexpr int64_t kSpikesPerTask = 16;  // few, and each is pierced and fitted anew
// Vertices between two progress reports.
constexpr int kChunk = 32768;
// Nearest cloud points tried where no coarser vertex tells where to start.
constexpr int kStartCandidates = 16;
// Fits that share most of their points agree far better than this; see PredictionFailures.
constexpr float kPredictedDeviations = 1.5f;
// A spike between two others shows when they are gone.
constexpr int kDespikeRounds = 3;
// A side's plane is not believed farther off the height that was sampled.
constexpr float kFarthestSpacings = 1.0f;
constexpr float kFarthestNoises = 3.0f;
// The sides of a crease are not believed to meet farther from the points.
constexpr double kReachSpacings = 1;

}  // namespace

DomainSampling::DomainSampling(const RayCloud& cloud, const NeighborGraph& graph,
                               const PointIndex& index, const LoopRefinement& refinement,
                               const LevelRings& rings, const LimitSurface& limit,
                               const DisplacementOptions& options, const RunContext& context)
    : cloud_(cloud),
      graph_(graph),
      index_(index),
      refinement_(refinement),
      rings_(rings),
      limit_(limit),
      options_(options),
      context_(context),
      common_bounds_(static_cast<size_t>((limit.positions.cols() + kInCommon - 1) / kInCommon)),
      samples_(static_cast<size_t>(limit.positions.cols())) {
  static_assert(kBlock % kInCommon == 0);
  // A stop is noticed in the passes.
  ParallelFor(samples_.size(), kBlock, context, [&](int64_t begin, int64_t end) {
    for (int v = static_cast<int>(begin); v < end; ++v) {
      const HeightBounds own = BoundsOf(v, rings_, limit_, options_.max_height);
      HeightBounds& common = common_bounds_[v / kInCommon];
      if (v % kInCommon == 0) common = own;
      common.lowest = std::max(common.lowest, own.lowest);
      common.highest = std::min(common.highest, own.highest);
    }
  }).IgnoreError();
}

absl::Status DomainSampling::IntersectNormals(double progress_end) {
  int sampled = 0;
  for (int level = 0; level <= refinement_.max_level(); ++level) {
    const int end = refinement_.levels[level].vertex_count;
    const MeshTopology* coarser = level > 0 ? &refinement_.levels[level - 1] : nullptr;
    while (sampled < end) {
      const int count = std::min(end - sampled, kChunk);
      RILIEVO_RETURN_IF_ERROR(
          ParallelFor(count, kRaysPerTask, context_,
                      [&, first = sampled](int64_t block_begin, int64_t block_end) {
                        HeightSampler sampler(cloud_, graph_, options_);
                        for (int64_t i = block_begin; i < block_end; ++i) {
                          const int vertex = static_cast<int>(first + i);
                          Store(vertex, PierceVertex(vertex, coarser, &sampler));
                        }
                      }));
      sampled += count;
      context_.Report(Stage::kDisplacement, progress_end * sampled / samples_.size());
    }
  }
  return absl::OkStatus();
}

absl::Status DomainSampling::RefineNoisy() {
  if (IsLeftOut(Mechanism::kLocalFit)) return absl::OkStatus();
  std::vector<int> coarser;
  for (int v = 0; v < refinement_.vertex_count(std::max(0, refinement_.max_level() - 1)); ++v) {
    if (WantsFit(v)) coarser.push_back(v);
  }
  RILIEVO_RETURN_IF_ERROR(Refine(std::move(coarser)));
  return refinement_.max_level() > 0 ? Refine(TakePredicted()) : absl::OkStatus();
}

bool DomainSampling::WantsFit(int vertex) const {
  if (!samples_.measured[vertex]) return false;
  const RayPoint& foot = cloud_.points[samples_.foot[vertex]];
  return IsNoisy(foot, options_) || (!samples_.crease[vertex] && IsWorthFitting(foot, options_));
}

std::vector<int> DomainSampling::TakePredicted() {
  const MeshTopology& coarser = refinement_.levels[refinement_.max_level() - 1];
  const std::vector<uint8_t> rough =
      PredictionFailures(refinement_, refinement_.max_level() - 1, kPredictedDeviations, samples_);
  std::vector<int> left;
  for (int edge = 0; edge < coarser.edge_count(); ++edge) {
    const int vertex = coarser.vertex_count + edge;
    if (!WantsFit(vertex)) continue;
    const auto ends = coarser.edge_vertices.col(edge);
    const auto predicted = rough[ends[0]] != 0 || rough[ends[1]] != 0
                               ? std::nullopt
                               : PredictHeight(coarser, edge, samples_);
    if (!predicted) {
      left.push_back(vertex);
      continue;
    }
    HeightEstimate estimate = EstimateOf(vertex);
    estimate.height = *predicted;
    estimate.deviation = std::max(samples_.deviation[ends[0]], samples_.deviation[ends[1]]);
    estimate.fitted = true;
    Store(vertex, estimate);
  }
  return left;
}

absl::Status DomainSampling::Refine(std::vector<int> vertices) {
  // Ordered by their feet: the cloud is in Morton order, so that neighbours share a block, and in
  // the block the points that they are fitted to.
  std::sort(vertices.begin(), vertices.end(), [&](int a, int b) {
    return samples_.foot[a] != samples_.foot[b] ? samples_.foot[a] < samples_.foot[b] : a < b;
  });
  return ParallelFor(static_cast<int64_t>(vertices.size()), kBlock, context_,
                     [&](int64_t begin, int64_t end) {
                       HeightSampler sampler(cloud_, graph_, options_);
                       std::vector<RaySample> block(end - begin);
                       for (int64_t i = begin; i < end; ++i) {
                         block[i - begin] = {RayOf(vertices[i]), EstimateOf(vertices[i])};
                       }
                       sampler.Refine(block);
                       for (int64_t i = begin; i < end; ++i) {
                         Store(vertices[i], block[i - begin].estimate);
                       }
                     });
}

absl::Status DomainSampling::Despike() {
  for (int round = 0; round < kDespikeRounds; ++round) {
    RILIEVO_ASSIGN_OR_RETURN(const bool any, DespikeOnce());
    if (!any) break;
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> DomainSampling::DespikeOnce() {
  const auto contradicted = [&](int vertex) {
    return IsContradicted(vertex, samples_.height[vertex]);
  };
  RILIEVO_ASSIGN_OR_RETURN(
      const std::vector<Spike> spikes,
      FindSpikes(refinement_.levels.back(), rings_, samples_, contradicted, context_));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(static_cast<int64_t>(spikes.size()), kSpikesPerTask, context_,
                  [&](int64_t begin, int64_t end) {
                    HeightSampler sampler(cloud_, graph_, options_);
                    for (int64_t i = begin; i < end; ++i) {
                      const auto [vertex, expected, tolerance] = spikes[i];
                      const Ray ray = RayOf(vertex);
                      auto again = sampler.Pierce(ray, samples_.foot[vertex], expected);
                      if (again) {
                        RaySample sample = {ray, *again};
                        sampler.Refine({&sample, 1});
                        again = sample.estimate;
                      }
                      const bool good = again && std::abs(again->height - expected) <= tolerance &&
                                        !IsContradicted(vertex, again->height);
                      if (good) again->fitted = true;
                      Store(vertex, good ? again : std::nullopt);
                    }
                  }));
  return !spikes.empty();
}

bool DomainSampling::IsContradicted(int vertex, float height) const {
  const Eigen::Vector3d direction = limit_.normals.col(vertex);
  return ContradictsPoints(cloud_, index_, limit_.positions.col(vertex) + height * direction,
                           direction);
}

absl::Status DomainSampling::MeetSides(const OrientedCloud& cloud) {
  RILIEVO_ASSIGN_OR_RETURN(const SharpSectors sectors,
                           SectorsOfLevel(refinement_, refinement_.max_level()));
  std::vector<int> begin;
  for (int s = 0; s < sectors.size(); ++s) {
    if (s == 0 || sectors.vertices[s] != sectors.vertices[s - 1]) begin.push_back(s);
  }
  const auto count = static_cast<int64_t>(begin.size());
  begin.push_back(sectors.size());
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context_, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      const int vertex = sectors.vertices[begin[i]];
      if (samples_.measured[vertex] && samples_.crease[vertex]) continue;
      const auto sides = limit_.sector_normals.middleCols(begin[i], begin[i + 1] - begin[i]);
      const auto met = MeetAlongRay(cloud_, index_, limit_.positions.col(vertex),
                                    limit_.normals.col(vertex), sides);
      if (!met || !(IsInBounds(vertex, met->height) || !samples_.measured[vertex])) continue;
      const Eigen::Vector3d place =
          limit_.positions.col(vertex) + met->height * limit_.normals.col(vertex);
      if (HasSupport(cloud, index_, place, kReachSpacings)) Store(vertex, met);
    }
  }));
  return FitSides(cloud, sectors);
}

absl::Status DomainSampling::FitSides(const OrientedCloud& cloud, const SharpSectors& sectors) {
  const auto is_noisy = [&](int v) {
    return samples_.measured[v] && IsNoisy(cloud_.points[samples_.foot[v]], options_);
  };
  // The memory that follows would be the most that a clean scan takes at any time.
  if (std::none_of(sectors.vertices.begin(), sectors.vertices.end(), is_noisy)) {
    return absl::OkStatus();
  }
  std::vector<uint8_t> noisy(samples_.measured.size(), 0);
  for (const int v : sectors.vertices) noisy[v] = is_noisy(v);
  RILIEVO_ASSIGN_OR_RETURN(
      const std::vector<CreaseHeight> heights,
      HeightsBesideCreases(cloud, index_, rings_, limit_, sectors, noisy, samples_, context_));
  for (const CreaseHeight& height : heights) {
    const int v = height.vertex;
    // A plane that runs on where the surface does not is none of it.
    const float most = kFarthestSpacings * height.estimate.spacing +
                       kFarthestNoises * cloud_.points[height.estimate.foot].noise;
    if (samples_.measured[v] && std::abs(samples_.height[v] - height.estimate.height) > most) {
      continue;
    }
    if (samples_.measured[v] && !IsInBounds(v, height.estimate.height)) continue;
    Store(v, height.estimate);
  }
  return absl::OkStatus();
}

Ray DomainSampling::RayOf(int vertex) const {
  return MakeRay(limit_.positions.col(vertex), limit_.normals.col(vertex));
}

HeightEstimate DomainSampling::EstimateOf(int vertex) const {
  return {samples_.height[vertex], samples_.deviation[vertex],   samples_.spacing[vertex],
          samples_.foot[vertex],   samples_.crease[vertex] != 0, samples_.fitted[vertex] != 0};
}

bool DomainSampling::IsInBounds(int vertex, float height) const {
  if (IsInCommonBounds(vertex, height)) return true;
  const HeightBounds bounds = BoundsOf(vertex, rings_, limit_, options_.max_height);
  return height >= bounds.lowest && height <= bounds.highest;
}

bool DomainSampling::IsInCommonBounds(int vertex, float height) const {
  const HeightBounds& common = common_bounds_[vertex / kInCommon];
  return height >= common.lowest && height <= common.highest;
}

float DomainSampling::Bounded(int vertex, float height) const {
  if (IsInCommonBounds(vertex, height)) return height;
  const HeightBounds bounds = BoundsOf(vertex, rings_, limit_, options_.max_height);
  return std::clamp(height, bounds.lowest, bounds.highest);
}

void DomainSampling::Store(int vertex, const std::optional<HeightEstimate>& estimate) {
  const bool measured = estimate && IsInBounds(vertex, estimate->height);
  samples_.measured[vertex] = measured;
  samples_.height[vertex] = measured ? estimate->height : 0.0f;
  samples_.deviation[vertex] = measured ? estimate->deviation : 0.0f;
  samples_.spacing[vertex] = measured ? estimate->spacing : 0.0f;
  samples_.foot[vertex] = measured ? estimate->foot : -1;
  samples_.crease[vertex] = measured && estimate->crease;
  samples_.fitted[vertex] = measured && estimate->fitted;
}

// The nearest cloud point that faces along the ray within reach, or -1.
int DomainSampling::StartFromIndex(const Ray& ray, int vertex, float reference) const {
  std::array<int, kStartCandidates> candidates;
  std::array<double, kStartCandidates> distances;
  const Eigen::Vector3d at = limit_.positions.col(vertex) + reference * limit_.normals.col(vertex);
  const int found = index_.Nearest(at, std::min(kStartCandidates, index_.size()), candidates.data(),
                                   distances.data());
  for (int i = 0; i < found; ++i) {
    const RayPoint& point = cloud_.points[candidates[i]];
    const Eigen::Map<const Eigen::Vector3f> position(point.position), normal(point.normal);
    const float height = (position - ray.origin).dot(ray.direction);
    if (normal.dot(ray.direction) > options_.min_normal_agreement &&
        std::abs(height) <= options_.max_height) {
      return candidates[i];
    }
  }
  return -1;
}

// Starts from the coarser level's vertices on either side, or from the index.
std::optional<HeightEstimate> DomainSampling::PierceVertex(int vertex, const MeshTopology* coarser,
                                                           HeightSampler* sampler) const {
  const Ray ray = RayOf(vertex);
  int start = -1;
  float reference = 0;
  if (coarser != nullptr) {
    const auto ends = coarser->edge_vertices.col(vertex - coarser->vertex_count);
    int parents = 0;
    for (int end : {ends[0], ends[1]}) {
      if (!samples_.measured[end]) continue;
      reference += samples_.height[end];
      start = samples_.foot[end];
      ++parents;
    }
    if (parents == 2) reference *= 0.5f;
  }
  std::optional<HeightEstimate> estimate;
  if (start >= 0) estimate = sampler->Pierce(ray, start, reference);
  if (estimate) return estimate;
  start = StartFromIndex(ray, vertex, reference);
  return start >= 0 ? sampler->Pierce(ray, start, reference) : std::nullopt;
}

}  // namespace rilievo
