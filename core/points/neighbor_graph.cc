#include "core/points/neighbor_graph.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/points/batched_nearest.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

// The first `k` of the `nearest` but the point itself.
void CopyOthers(const int* nearest, int point, int k, int* neighbors) {
  for (int from = 0, to = 0; to < k; ++from) {
    if (nearest[from] != point) neighbors[to++] = nearest[from];
  }
}

}  // namespace

absl::Status NeighborOptions::Validate() const {
  if (k >= 6 && k <= kNeighborGraph.most_neighbors) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("k: ", k, " is outside [6, ", kNeighborGraph.most_neighbors, "]"));
}

void ListNeighbors(const PointIndex& index, const Eigen::Matrix3Xd& points, int point, int k,
                   int* neighbors) {
  std::array<int, kNeighborGraph.most_neighbors + 1> nearest;
  std::array<double, kNeighborGraph.most_neighbors + 1> squared;
  index.Nearest(points.col(point), k + 1, nearest.data(), squared.data());
  CopyOthers(nearest.data(), point, k, neighbors);
}

absl::Status NeighborGraph::Pack(const RunContext& context) {
  constexpr int kEntriesOfFar = 3;  // the mark and a number
  if (k < kEntriesOfFar || indices.empty()) return absl::OkStatus();
  std::vector<int16_t> packed(indices.size());
  std::vector<int> far;
  RILIEVO_RETURN_IF_ERROR(SerialFor(size(), context, [&](int64_t point) {
    const auto i = static_cast<int>(point);
    const int* const list = indices.data() + point * k;
    int16_t* const entries = packed.data() + point * k;
    int farthest = 0;
    for (int j = 0; j < k; ++j) {
      farthest = std::max(farthest, std::abs(list[j] - i));
      entries[j] = static_cast<int16_t>(list[j] - i);
    }
    if (farthest <= std::numeric_limits<int16_t>::max()) return;
    const auto number = static_cast<uint32_t>(far.size() / static_cast<size_t>(k));
    entries[0] = kFar;
    std::memcpy(entries + 1, &number, sizeof(number));
    far.insert(far.end(), list, list + k);
  }));
  differences = std::move(packed);
  far_lists = std::move(far);
  indices = std::vector<int>();
  return absl::OkStatus();
}

int NeighborGraph::across(int point) const {
  const auto pair = std::lower_bound(
      facing.begin(), facing.end(), point,
      [](const FacingPair& candidate, int wanted) { return candidate.point < wanted; });
  return pair != facing.end() && pair->point == point ? pair->across : -1;
}

std::vector<float> NeighborDistances(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                                     int point) {
  std::vector<float> distances;
  distances.reserve(static_cast<size_t>(graph.k));
  for (const int neighbor : graph.neighbors(point)) {
    distances.push_back(static_cast<float>((points.col(neighbor) - points.col(point)).norm()));
  }
  return distances;
}

absl::StatusOr<NeighborGraph> BuildNeighborGraph(const PointIndex& index,
                                                 const Eigen::Matrix3Xd& points,
                                                 const NeighborOptions& options,
                                                 const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (index.size() != points.cols()) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", points.cols(), " points, but the index holds ", index.size()));
  }
  NeighborGraph graph;
  graph.k = std::min<int>(options.k, index.size() - 1);
  const int k = graph.k;
  graph.indices.resize(static_cast<size_t>(points.cols()) * k);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(points.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        BatchedNearest nearby(index, points, k + 1);
        nearby.OfEach(points, begin, end, [&](int64_t i, const int* nearest, const double*) {
          CopyOthers(nearest, static_cast<int>(i), k, &graph.indices[i * k]);
        });
      }));
  return graph;
}

}  // namespace rilievo
