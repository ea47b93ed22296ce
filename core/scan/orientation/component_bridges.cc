#include "core/scan/orientation/component_bridges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "core/points/neighbor_graph.h"
#include "core/scan/orientation/edge_sign_votes.h"

namespace rilievo {
namespace {

constexpr double kReach = 3.0;  // spacings

struct Part {
  std::vector<int> members;
  Eigen::AlignedBox3d box;
  double reach = 0;  // of its coarsest point
  std::optional<PointIndex> index;
};

std::vector<Part> MakeParts(const OrientedCloud& cloud, const std::vector<int>& component,
                            int components) {
  std::vector<Part> parts(static_cast<size_t>(components));
  for (size_t i = 0; i < component.size(); ++i) {
    Part& part = parts[component[i]];
    part.members.push_back(static_cast<int>(i));
    part.box.extend(cloud.points.col(static_cast<int64_t>(i)));
    part.reach = std::max(part.reach, kReach * cloud.spacing[i]);
  }
  return parts;
}

// What pairs of points with a step between them say, each with the points of `many` around it.
// Evenly chosen ones speak for the rest.
void AskAcrossSteps(const OrientedCloud& cloud, const Part& many,
                    const std::vector<std::pair<int, int>>& steps, SignedLink link,
                    std::vector<SignedLink>* links) {
  constexpr int kMostAsked = 2048;
  constexpr int kAround = 8;
  const size_t stride = (steps.size() + kMostAsked - 1) / kMostAsked;
  const int k = std::min(kAround, many.index->size());
  std::array<int, kAround> around;
  std::array<double, kAround> squared_distances;
  for (size_t i = 0; i < steps.size(); i += stride) {
    const auto [a, b] = steps[i];
    const int found =
        many.index->Nearest(cloud.points.col(a), k, around.data(), squared_distances.data());
    for (int j = 0; j < found; ++j) around[j] = many.members[around[j]];
    link.weight = static_cast<double>(stride) *
                  WallVote(cloud, a, b, {around.data(), static_cast<size_t>(found)});
    links->push_back(link);
  }
}

// From each point of `few` to the nearest of `many`.
absl::StatusOr<std::vector<SignedLink>> Bridges(const OrientedCloud& cloud, int few_name,
                                                const Part& few, int many_name, Part* many,
                                                const RunContext& context) {
  if (!many->index) {
    const Eigen::Matrix3Xd points = cloud.points(Eigen::all, many->members);
    RILIEVO_ASSIGN_OR_RETURN(many->index, PointIndex::Build(points, context));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const std::vector<int> nearest,
      many->index->NearestOfEach(cloud.points(Eigen::all, few.members), context));
  std::vector<SignedLink> links;
  std::vector<std::pair<int, int>> steps;
  for (size_t i = 0; i < nearest.size(); ++i) {
    const int a = few.members[i];
    const int b = many->members[nearest[i]];
    const double gap = (cloud.points.col(a) - cloud.points.col(b)).norm();
    if (gap > kReach * std::max(cloud.spacing[a], cloud.spacing[b])) continue;
    if (StepBetween(cloud, a, b)) {
      steps.emplace_back(a, b);
    } else {
      links.push_back({few_name, many_name, SignVote(cloud, a, b)});
    }
  }
  AskAcrossSteps(cloud, *many, steps, {few_name, many_name, 0}, &links);
  return links;
}

}  // namespace

absl::StatusOr<std::vector<SignedLink>> BridgeComponents(const OrientedCloud& cloud,
                                                         const std::vector<int>& component,
                                                         int components,
                                                         const RunContext& context) {
  std::vector<SignedLink> links;
  if (components < 2 || IsLeftOut(Mechanism::kComponentBridges)) return links;
  std::vector<Part> parts = MakeParts(cloud, component, components);
  for (int a = 0; a < components; ++a) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    for (int b = a + 1; b < components; ++b) {
      const double reach = std::max(parts[a].reach, parts[b].reach);
      if (parts[a].box.exteriorDistance(parts[b].box) > reach) continue;
      const bool a_is_few = parts[a].members.size() <= parts[b].members.size();
      const int few = a_is_few ? a : b, many = a_is_few ? b : a;
      RILIEVO_ASSIGN_OR_RETURN(const std::vector<SignedLink> bridges,
                               Bridges(cloud, few, parts[few], many, &parts[many], context));
      links.insert(links.end(), bridges.begin(), bridges.end());
    }
  }
  return links;
}

}  // namespace rilievo
