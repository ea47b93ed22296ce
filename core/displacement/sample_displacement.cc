#include "core/displacement/sample_displacement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/displacement/calibrate_noise.h"
#include "core/displacement/despike_heights.h"
#include "core/displacement/fill_heights.h"
#include "core/displacement/height_sampler.h"
#include "core/displacement/height_samples.h"
#include "core/displacement/input_laplacian.h"
#include "core/displacement/ray_cloud.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 256;
// Vertices between two progress reports.
constexpr int kChunk = 32768;
// Nearest cloud points tried where no coarser vertex tells where to start.
constexpr int kStartCandidates = 16;
// An offset surface folds where 1 + height * curvature reaches 0; heights stop short of it.
constexpr float kFoldMargin = 0.9f;
// Share of the stage's time that the sampling takes, for the progress.
constexpr double kSamplingShare = 0.85;

// Bounds of each height: the option's, and the domain's radii of curvature on either side.
std::vector<HeightBounds> BoundHeights(const MeshTopology& topology, const LimitSurface& limit,
                                       float max_height) {
  std::vector<float> most(topology.vertex_count, 0.0f), least(topology.vertex_count, 0.0f);
  for (const auto& edge : topology.edge_vertices.colwise()) {
    const Eigen::Vector3d along = limit.positions.col(edge[1]) - limit.positions.col(edge[0]);
    const double square = along.squaredNorm();
    if (!(square > 0)) continue;
    const Eigen::Vector3d turn = limit.normals.col(edge[1]) - limit.normals.col(edge[0]);
    const float curvature = static_cast<float>(turn.dot(along) / square);
    for (int vertex : {edge[0], edge[1]}) {
      most[vertex] = std::max(most[vertex], curvature);
      least[vertex] = std::min(least[vertex], curvature);
    }
  }
  std::vector<HeightBounds> bounds(topology.vertex_count);
  for (int v = 0; v < topology.vertex_count; ++v) {
    bounds[v].lowest = -std::min(max_height, kFoldMargin / std::max(most[v], 1e-6f));
    bounds[v].highest = std::min(max_height, kFoldMargin / std::max(-least[v], 1e-6f));
  }
  return bounds;
}

// The stage at work on one cloud and one domain.
class Sampling {
 public:
  Sampling(const RayCloud& cloud, const NeighborGraph& graph, const PointIndex& index,
           const LoopRefinement& refinement, const LimitSurface& limit,
           const DisplacementOptions& options, const RunContext& context)
      : cloud_(cloud),
        graph_(graph),
        index_(index),
        refinement_(refinement),
        limit_(limit),
        options_(options),
        context_(context),
        bounds_(BoundHeights(refinement.levels.back(), limit,
                             // Rounded down, for the float may lie above the double.
                             std::nextafter(static_cast<float>(options.max_height), 0.0f))),
        samples_(static_cast<size_t>(limit.positions.cols())) {}

  // Coarse to fine: the heights of a level tell the next one where to look.
  absl::Status SampleLevels() {
    int sampled = 0;
    for (int level = 0; level <= refinement_.max_level(); ++level) {
      const int end = refinement_.levels[level].vertex_count;
      const MeshTopology* coarser = level > 0 ? &refinement_.levels[level - 1] : nullptr;
      while (sampled < end) {
        const int chunk_end = std::min(end, sampled + kChunk);
        const auto body = [&, first = sampled](int64_t block_begin, int64_t block_end) {
          SampleBlock(static_cast<int>(first + block_begin), static_cast<int>(first + block_end),
                      coarser);
        };
        RILIEVO_RETURN_IF_ERROR(ParallelFor(chunk_end - sampled, kBlock, context_, body));
        sampled = chunk_end;
        context_.Report(Stage::kDisplacement, kSamplingShare * sampled / samples_.size());
      }
    }
    return absl::OkStatus();
  }

  // Measures spikes again by the robust fit near their ring's height; what still stands out is
  // given to the filling.
  absl::Status Despike(const VertexRings& rings) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<Spike> spikes,
                             FindSpikes(rings, samples_, context_));
    return ParallelFor(
        static_cast<int64_t>(spikes.size()), kBlock, context_, [&](int64_t begin, int64_t end) {
          HeightSampler sampler(cloud_, graph_, options_);
          std::vector<RaySample> block(end - begin);
          for (int64_t i = begin; i < end; ++i) {
            const Spike& spike = spikes[i];
            RaySample& sample = block[i - begin];
            sample = {RayOf(spike.vertex), bounds_[spike.vertex], std::nullopt, true};
            sample.estimate =
                sampler.Pierce(sample.ray, samples_.foot[spike.vertex], spike.expected);
          }
          sampler.Refine(block);
          for (int64_t i = begin; i < end; ++i) {
            const auto& again = block[i - begin].estimate;
            const bool good =
                again && std::abs(again->height - spikes[i].expected) <= spikes[i].tolerance;
            Store(spikes[i].vertex, good ? again : std::nullopt);
          }
        });
  }

  const std::vector<HeightBounds>& bounds() const { return bounds_; }
  HeightSamples& samples() { return samples_; }

 private:
  Ray RayOf(int vertex) const {
    return MakeRay(limit_.positions.col(vertex), limit_.normals.col(vertex));
  }

  void Store(int vertex, const std::optional<HeightEstimate>& estimate) {
    samples_.measured[vertex] = estimate.has_value();
    samples_.height[vertex] = estimate ? estimate->height : 0.0f;
    samples_.deviation[vertex] = estimate ? estimate->deviation : 0.0f;
    samples_.spacing[vertex] = estimate ? estimate->spacing : 0.0f;
    samples_.foot[vertex] = estimate ? estimate->foot : -1;
    samples_.crease[vertex] = estimate && estimate->crease;
  }

  // The nearest cloud point that faces along the ray within reach, or -1.
  int StartFromIndex(const Ray& ray, int vertex, float reference) const {
    std::array<int, kStartCandidates> candidates;
    std::array<double, kStartCandidates> distances;
    const Eigen::Vector3d at =
        limit_.positions.col(vertex) + reference * limit_.normals.col(vertex);
    const int found = index_.Nearest(at, std::min(kStartCandidates, index_.size()),
                                     candidates.data(), distances.data());
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

  void SampleBlock(int begin, int end, const MeshTopology* coarser) {
    HeightSampler sampler(cloud_, graph_, options_);
    std::vector<RaySample> block(end - begin);
    for (int vertex = begin; vertex < end; ++vertex) {
      RaySample& sample = block[vertex - begin];
      sample.ray = RayOf(vertex);
      sample.bounds = bounds_[vertex];
      sample.estimate = PierceVertex(sample.ray, vertex, coarser, &sampler);
    }
    sampler.Refine(block);
    for (int vertex = begin; vertex < end; ++vertex) Store(vertex, block[vertex - begin].estimate);
  }

  // Starts from the coarser level's vertices on either side, or from the index.
  std::optional<HeightEstimate> PierceVertex(const Ray& ray, int vertex,
                                             const MeshTopology* coarser,
                                             HeightSampler* sampler) const {
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

  const RayCloud& cloud_;
  const NeighborGraph& graph_;
  const PointIndex& index_;
  const LoopRefinement& refinement_;
  const LimitSurface& limit_;
  const DisplacementOptions& options_;
  const RunContext& context_;
  std::vector<HeightBounds> bounds_;
  HeightSamples samples_;
};

absl::Status CheckInput(const OrientedCloud& cloud, const NeighborGraph& graph,
                        const PointIndex& index, const LoopRefinement& refinement,
                        const LimitSurface& limit) {
  const int64_t count = cloud.points.cols();
  if (count == 0 || cloud.normals.cols() != count ||
      static_cast<int64_t>(cloud.spacing.size()) != count ||
      static_cast<int64_t>(cloud.noise.size()) != count) {
    return absl::InvalidArgumentError(absl::StrCat(
        "cloud: ", count, " points, ", cloud.normals.cols(), " normals, ", cloud.spacing.size(),
        " spacings, ", cloud.noise.size(), " noises; all four must be equal and not 0"));
  }
  if (graph.size() != count || index.size() != count) {
    return absl::InvalidArgumentError(absl::StrCat("graph and index: made for ", graph.size(),
                                                   " and ", index.size(), " points, not for ",
                                                   count));
  }
  const int vertices = refinement.levels.empty() ? 0 : refinement.levels.back().vertex_count;
  if (vertices == 0 || limit.positions.cols() != vertices || limit.normals.cols() != vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat("limit: ", limit.positions.cols(), " positions and ", limit.normals.cols(),
                     " normals; the finest level has ", vertices, " vertices"));
  }
  if (!limit.positions.allFinite() || !limit.normals.allFinite()) {
    return absl::InvalidArgumentError("limit: positions or normals are not finite");
  }
  return absl::OkStatus();
}

DisplacementField MakeField(const std::vector<float>& sampled,
                            const std::vector<HeightBounds>& bounds, HeightSamples samples) {
  DisplacementField field;
  const int count = samples.size();
  field.source.resize(count);
  for (int v = 0; v < count; ++v) {
    float& height = samples.height[v];
    if (!std::isfinite(height)) height = 0;
    height = std::clamp(height, bounds[v].lowest, bounds[v].highest);
    if (!samples.measured[v]) {
      field.source[v] = HeightSource::kFilled;
      ++field.filled;
    } else if (std::abs(height - sampled[v]) > samples.deviation[v]) {
      field.source[v] = HeightSource::kSmoothed;
      ++field.smoothed;
    } else {
      field.source[v] = HeightSource::kMeasured;
      ++field.measured;
    }
  }
  field.heights = std::move(samples.height);
  return field;
}

}  // namespace

absl::Status DisplacementOptions::Validate() const {
  const auto refuse = [](const char* name, double value, const char* range) {
    return absl::InvalidArgumentError(
        absl::StrCat("displacement.", name, " is ", value, "; it must be in ", range));
  };
  if (!(max_height > 0 && max_height <= 0.5)) return refuse("max_height", max_height, "(0, 0.5]");
  if (!(min_normal_agreement >= -1 && min_normal_agreement < 1)) {
    return refuse("min_normal_agreement", min_normal_agreement, "[-1, 1)");
  }
  if (max_queue < 3 || max_queue > 256) return refuse("max_queue", max_queue, "[3, 256]");
  if (!(max_triangle_spacings > 1 && std::isfinite(max_triangle_spacings))) {
    return refuse("max_triangle_spacings", max_triangle_spacings, "(1, inf)");
  }
  if (!(plane_noise_ratio >= 0)) return refuse("plane_noise_ratio", plane_noise_ratio, "[0, inf]");
  if (smoothing_rounds < 0 || smoothing_rounds > 20) {
    return refuse("smoothing_rounds", smoothing_rounds, "[0, 20]");
  }
  return absl::OkStatus();
}

absl::StatusOr<DisplacementField> SampleDisplacement(
    const OrientedCloud& cloud, const NeighborGraph& graph, const PointIndex& index,
    const LoopRefinement& refinement, const LimitSurface& limit, const DisplacementOptions& options,
    const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckInput(cloud, graph, index, refinement, limit));
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  context.Report(Stage::kDisplacement, 0.0);
  RILIEVO_ASSIGN_OR_RETURN(RayCloud ray_cloud, PrepareRayCloud(cloud, graph, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const float noise_factor,
      NoiseCalibration(ray_cloud, graph, static_cast<float>(options.plane_noise_ratio), context));
  for (RayPoint& point : ray_cloud.points) point.noise *= noise_factor;
  const VertexRings rings = BuildVertexRings(refinement.levels.back());
  Sampling sampling(ray_cloud, graph, index, refinement, limit, options, context);
  RILIEVO_RETURN_IF_ERROR(sampling.SampleLevels());
  RILIEVO_RETURN_IF_ERROR(sampling.Despike(rings));
  HeightSamples& samples = sampling.samples();
  const std::vector<float> sampled = samples.height;
  RILIEVO_RETURN_IF_ERROR(SmoothHeights(rings, options.smoothing_rounds, context, &samples));
  context.Report(Stage::kDisplacement, 0.9);
  RILIEVO_RETURN_IF_ERROR(FillHeights(refinement, samples.measured, context, &samples.height));
  context.Report(Stage::kDisplacement, 1.0);
  return MakeField(sampled, sampling.bounds(), std::move(samples));
}

}  // namespace rilievo
