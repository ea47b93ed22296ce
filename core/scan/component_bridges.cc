#include "core/scan/component_bridges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/normal_relations.h"

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

// From each point of `few` to the nearest of `many`.
absl::StatusOr<std::vector<SignedLink>> Bridges(const OrientedCloud& cloud, int few_name,
                                                const Part& few, int many_name, Part* many,
                                                const RunContext& context) {
  if (!many->index) many->index.emplace(Eigen::Matrix3Xd(cloud.points(Eigen::all, many->members)));
  RILIEVO_ASSIGN_OR_RETURN(
      const std::vector<int> nearest,
      many->index->NearestOfEach(cloud.points(Eigen::all, few.members), context));
  std::vector<SignedLink> links;
  for (size_t i = 0; i < nearest.size(); ++i) {
    const int a = few.members[i];
    const int b = many->members[nearest[i]];
    const double gap = (cloud.points.col(a) - cloud.points.col(b)).norm();
    if (gap > kReach * std::max(cloud.spacing[a], cloud.spacing[b])) continue;
    links.push_back({few_name, many_name, NormalRelation(cloud, a, b)});
  }
  return links;
}

}  // namespace

absl::StatusOr<std::vector<SignedLink>> BridgeComponents(const OrientedCloud& cloud,
                                                         const std::vector<int>& component,
                                                         int components,
                                                         const RunContext& context) {
  std::vector<SignedLink> links;
  if (components < 2) return links;
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
