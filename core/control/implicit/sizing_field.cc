#include "core/control/implicit/sizing_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/control/implicit/settings.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

// Distance across from point i to point j when j lies on an opposite sheet, else infinite.
float Across(const OrientedCloud& cloud, int i, int j) {
  const Eigen::Vector3d normal = cloud.normals.col(i);
  if (normal.dot(cloud.normals.col(j)) > -kCommon.same_side) return kNone;
  const Eigen::Vector3d chord = cloud.points.col(j) - cloud.points.col(i);
  const double across = std::abs(chord.dot(normal));
  return across < kSizingField.across_share * chord.norm() ? kNone : static_cast<float>(across);
}

float SheetDistanceOf(const OrientedCloud& cloud, const NeighborGraph& graph,
                      const PointIndex& index, int i) {
  for (const int j : graph.neighbors(i)) {
    const float across = Across(cloud, i, j);
    if (across < kNone) return across;
  }
  float nearest = kNone;
  if (i % kSizingField.probe_stride != 0) return nearest;
  for (const double side : {-kCommon.gap_spacings, kCommon.gap_spacings}) {
    const Eigen::Vector3d probe =
        cloud.points.col(i) + side * double{cloud.spacing[i]} * cloud.normals.col(i);
    int found = 0;
    double squared = 0;
    index.Nearest(probe, 1, &found, &squared);
    if (found != i) nearest = std::min(nearest, Across(cloud, i, found));
  }
  return nearest;
}

// Distance to the opposite sheet, the least that a point or its neighbours see; infinite where too
// few of them see one.
absl::StatusOr<std::vector<float>> SheetDistances(const OrientedCloud& cloud,
                                                  const NeighborGraph& graph,
                                                  const PointIndex& index,
                                                  const RunContext& context) {
  std::vector<float> own(graph.size()), agreed(graph.size());
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kLightBlock, context, [&](int64_t i) {
    own[i] = SheetDistanceOf(cloud, graph, index, static_cast<int>(i));
  }));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kLightBlock, context, [&](int64_t i) {
    int witnesses = own[i] < kNone;
    float least = own[i];
    for (const int j : graph.neighbors(static_cast<int>(i))) {
      witnesses += own[j] < kNone;
      least = std::min(least, own[j]);
    }
    agreed[i] = witnesses >= kSizingField.least_witnesses ? least : kNone;
  }));
  return agreed;
}

// Whether the neighbours of a point leave a wide angle free, seen along its normal.
bool IsOneSided(const OrientedCloud& cloud, const NeighborGraph& graph, int i) {
  const Eigen::Vector3d point = cloud.points.col(i), normal = cloud.normals.col(i);
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::array<double, kNeighborGraph.most_neighbors> angles;
  int count = 0;
  for (const int j : graph.neighbors(i)) {
    const Eigen::Vector3d chord = cloud.points.col(j) - point;
    angles[count++] = std::atan2(v.dot(chord), u.dot(chord));
  }
  std::sort(angles.begin(), angles.begin() + count);
  for (int k = 0; k < count; ++k) {
    const double next = k + 1 == count ? angles[0] + 2 * std::numbers::pi : angles[k + 1];
    if (next - angles[k] > kSizingField.free_angle) return true;
  }
  return false;
}

// 1 for the points on the border of an open scan, told from chance by neighbours that are, too.
absl::StatusOr<std::vector<uint8_t>> BorderPoints(const OrientedCloud& cloud,
                                                  const NeighborGraph& graph,
                                                  const RunContext& context) {
  std::vector<uint8_t> one_sided(graph.size()), border(graph.size());
  const auto each = [&](const auto& body) {
    return ParallelForEach(graph.size(), kLightBlock, context,
                           [&](int64_t i) { body(static_cast<int>(i)); });
  };
  RILIEVO_RETURN_IF_ERROR(each([&](int i) { one_sided[i] = IsOneSided(cloud, graph, i); }));
  RILIEVO_RETURN_IF_ERROR(each([&](int i) {
    int witnesses = 0;
    for (const int j : graph.neighbors(i)) witnesses += one_sided[j];
    border[i] = one_sided[i] != 0 && witnesses >= kSizingField.least_witnesses;
  }));
  return border;
}

// Whether the normals of all neighbours of a point are about its own, on either side, as on an arc
// of the radius of two of its cells.
bool IsSmooth(const OrientedCloud& cloud, const NeighborGraph& graph, int i) {
  const Eigen::Vector3d normal = cloud.normals.col(i);
  for (const int j : graph.neighbors(i)) {
    if (std::abs(normal.dot(cloud.normals.col(j))) < kCommon.smooth_cosine) return false;
  }
  return true;
}

// Spacing of as many points spread evenly over the same area: unlike the median it is not ruled by
// the dense parts of a scan, so the grid stays in proportion to the points.
double EvenSpacing(const OrientedCloud& cloud) {
  double squares = 0;
  for (const float spacing : cloud.spacing) squares += double{spacing} * spacing;
  return std::sqrt(squares / static_cast<double>(cloud.spacing.size()));
}

}  // namespace

absl::StatusOr<std::vector<float>> SizingField(const OrientedCloud& cloud,
                                               const NeighborGraph& graph, const PointIndex& index,
                                               const ImplicitOptions& options,
                                               const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<float> sheet_distance,
                           SheetDistances(cloud, graph, index, context));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> border, BorderPoints(cloud, graph, context));
  const double least_spacing =
      std::max(cloud.median_spacing, kSizingField.even_share * EvenSpacing(cloud));
  std::vector<float> cells(sheet_distance.size());
  for (size_t i = 0; i < cells.size(); ++i) {
    const double usual = options.cell_spacings * std::max<double>(least_spacing, cloud.spacing[i]);
    const bool is_smooth = IsSmooth(cloud, graph, static_cast<int>(i));
    const double plain = border[i] != 0 && !IsLeftOut(Mechanism::kBorderCells) ? usual / 2
                         : is_smooth && !IsLeftOut(Mechanism::kSmoothCells)    ? usual * 2
                                                                               : usual;
    const double thin = std::max(options.cell_thicknesses * double{sheet_distance[i]}, usual / 2);
    cells[i] = static_cast<float>(
        std::max(IsLeftOut(Mechanism::kThinCells) ? plain : std::min(thin, plain),
                 options.cell_noises * std::max<double>(cloud.noise[i], cloud.median_noise)));
  }
  return cells;
}

}  // namespace rilievo
