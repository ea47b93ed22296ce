#include "core/domain/sample_targets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/parallel_for_each.h"
#include "core/domain/settings.h"
#include "core/domain/sharp_foot_points.h"

namespace rilievo {
namespace {

struct Aim {
  const DomainSamples& samples;
  const FootPoints& feet;
  const SampledSurface& surface;
  const AreaShares& areas;
  double tangential_weight;

  void At(int sample, SampleTargets* targets) const {
    const auto i = static_cast<size_t>(sample);
    if (samples.is_sharp(sample) && !samples.on_boundary(sample)) return AtSharp(sample, targets);
    const bool corner = sample < samples.control_vertex_count();
    const bool data = feet.weight[i] > 0, border = feet.border_weight[i] > 0;
    auto directions = targets->weighted_directions.col(sample);
    targets->positions.col(sample) = surface.positions.col(sample) +
                                     feet.offset[i] * feet.normals.col(sample) +
                                     feet.border_offset[i] * feet.conormals.col(sample);
    directions.setZero();
    if (!data && !border) {
      if (!corner) return;
      const double hold = std::sqrt(kSampleTargets.hold_weight * areas.control_vertices[i]);
      directions(0) = directions(4) = directions(8) = hold;
      return;
    }
    const Eigen::Vector3d normal = data ? feet.normals.col(sample) : surface.normals.col(sample);
    Eigen::Vector3d across = feet.conormals.col(sample);
    if (across.isZero()) across = normal.unitOrthogonal();
    const double beside = corner ? tangential_weight * areas.control_vertices[i] : 0.0;
    const double toward_border = border ? kSampleTargets.border_weight * areas.samples[i] : beside;
    directions.segment<3>(0) = std::sqrt(feet.weight[i] * areas.samples[i]) * normal;
    directions.segment<3>(3) = std::sqrt(toward_border) * across;
    directions.segment<3>(6) = std::sqrt(beside) * normal.cross(across);
  }

  // Held across the crease by its sides, and free along it as elsewhere in the tangent plane.
  void AtSharp(int sample, SampleTargets* targets) const {
    const auto i = static_cast<size_t>(sample);
    const bool corner = sample < samples.control_vertex_count();
    auto directions = targets->weighted_directions.col(sample);
    targets->positions.col(sample) =
        surface.positions.col(sample) + feet.sharp_moves.col(samples.sharp_slot[i]);
    directions.setZero();
    const double beside = corner ? tangential_weight * areas.control_vertices[i] : 0.0;
    const SideAxes& sides = feet.sharp_axes[samples.sharp_slot[i]];
    const int rows = targets->row_count[i];
    for (int k = 0; k < rows; ++k) {
      const bool data = feet.weight[i] > 0 && sides.strength[k] > kSharpFootPoints.least_strength;
      double weight = data ? feet.weight[i] * areas.samples[i] * sides.strength[k] : beside;
      if (corner && feet.weight[i] == 0)
        weight = kSampleTargets.hold_weight * areas.control_vertices[i];
      directions.segment<3>(3 * k) = std::sqrt(weight) * sides.axes.col(k);
    }
  }
};

}  // namespace

SampleTargets MakeSampleTargets(const DomainSamples& samples) {
  SampleTargets targets;
  targets.positions.setZero(3, samples.size());
  targets.weighted_directions.setZero(9, samples.size());
  targets.row_count.resize(static_cast<size_t>(samples.size()));
  for (int i = 0; i < samples.size(); ++i) {
    const bool corner = i < samples.control_vertex_count();
    targets.row_count[static_cast<size_t>(i)] = corner                                          ? 3
                                                : samples.on_boundary(i) || samples.is_sharp(i) ? 2
                                                                                                : 1;
  }
  return targets;
}

absl::Status AimSamples(const DomainSamples& samples, const SampledSurface& surface,
                        const FootPoints& foot_points, const AreaShares& areas,
                        double tangential_weight, const RunContext& context,
                        SampleTargets* targets) {
  const Aim aim{samples, foot_points, surface, areas, tangential_weight};
  return ParallelForEach(samples.size(), kLightBlock, context,
                         [&](int64_t i) { aim.At(static_cast<int>(i), targets); });
}

}  // namespace rilievo
