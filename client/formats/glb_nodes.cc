#include "client/formats/glb_nodes.h"

#include <algorithm>
#include <array>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Json = GlbDocument::Json;

constexpr int kMostDepth = 256;

template <typename... Words>
absl::Status NodeError(uint64_t node, const Words&... words) {
  return absl::InvalidArgumentError(absl::StrCat("nodes[", node, "]: ", words...));
}

// Leaves `numbers` as they are where there is no such member.
template <size_t kCount>
absl::Status TakeNumbers(const Json& node, const char* name, std::array<double, kCount>* numbers) {
  const Json* list = GlbDocument::Find(node, name);
  if (list == nullptr) return absl::OkStatus();
  const bool fits =
      list->is_array() && list->size() == kCount &&
      std::all_of(list->begin(), list->end(), [](const Json& entry) { return entry.is_number(); });
  if (!fits)
    return absl::InvalidArgumentError(absl::StrCat("'", name, "' must be ", kCount, " numbers"));
  for (size_t i = 0; i < kCount; ++i) (*numbers)[i] = (*list)[i].get<double>();
  return absl::OkStatus();
}

absl::StatusOr<Eigen::Affine3d> TransformOf(const Json& node) {
  std::array<double, 16> matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::array<double, 3> translation = {0, 0, 0}, scale = {1, 1, 1};
  std::array<double, 4> rotation = {0, 0, 0, 1};  // x, y, z, w
  RILIEVO_RETURN_IF_ERROR(TakeNumbers(node, "matrix", &matrix));
  RILIEVO_RETURN_IF_ERROR(TakeNumbers(node, "translation", &translation));
  RILIEVO_RETURN_IF_ERROR(TakeNumbers(node, "rotation", &rotation));
  RILIEVO_RETURN_IF_ERROR(TakeNumbers(node, "scale", &scale));
  if (matrix[3] != 0 || matrix[7] != 0 || matrix[11] != 0 || matrix[15] != 1) {
    return absl::InvalidArgumentError("the last row of 'matrix' must be 0 0 0 1");
  }
  Eigen::Affine3d transform(Eigen::Map<const Eigen::Matrix4d>(matrix.data()));
  if (GlbDocument::Find(node, "matrix") != nullptr) return transform;
  Eigen::Quaterniond turn(rotation[3], rotation[0], rotation[1], rotation[2]);
  if (!(turn.norm() > 0.5 && turn.norm() < 2)) {
    return absl::InvalidArgumentError("'rotation' must be a unit quaternion");
  }
  return Eigen::Translation3d(Eigen::Map<const Eigen::Vector3d>(translation.data())) *
         turn.normalized() * Eigen::Scaling(Eigen::Map<const Eigen::Vector3d>(scale.data()));
}

absl::StatusOr<std::vector<uint64_t>> NodeList(const Json& owner, const char* name) {
  RILIEVO_ASSIGN_OR_RETURN(const Json* list, GlbDocument::List(owner, name));
  std::vector<uint64_t> nodes;
  for (const Json& entry : *list) {
    if (!entry.is_number_unsigned()) {
      return absl::InvalidArgumentError(absl::StrCat("'", name, "' must be numbers of nodes"));
    }
    nodes.push_back(entry.get<uint64_t>());
  }
  return nodes;
}

// For each node whether it is the child of another.
absl::StatusOr<std::vector<bool>> FindChildren(const GlbDocument& document) {
  RILIEVO_ASSIGN_OR_RETURN(const Json* nodes, GlbDocument::List(document.root(), "nodes"));
  std::vector<bool> is_child(nodes->size(), false);
  for (uint64_t node = 0; node < nodes->size(); ++node) {
    const auto children = NodeList((*nodes)[node], "children");
    if (!children.ok()) return NodeError(node, children.status().message());
    for (const uint64_t child : *children) {
      if (child >= nodes->size()) return NodeError(node, "its child ", child, " does not exist");
      if (is_child[child]) return NodeError(child, "is a child twice; nodes must be a tree");
      is_child[child] = true;
    }
  }
  return is_child;
}

absl::StatusOr<std::vector<uint64_t>> RootNodes(const GlbDocument& document) {
  RILIEVO_ASSIGN_OR_RETURN(std::vector<bool> is_taken, FindChildren(document));
  if (GlbDocument::Find(document.root(), "scene") == nullptr) {
    std::vector<uint64_t> roots;
    for (uint64_t node = 0; node < is_taken.size(); ++node) {
      if (!is_taken[node]) roots.push_back(node);
    }
    return roots;
  }
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t index, GlbDocument::Whole(document.root(), "scene"));
  RILIEVO_ASSIGN_OR_RETURN(const Json* scene, document.Item("scenes", index));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint64_t> roots, NodeList(*scene, "nodes"));
  for (const uint64_t node : roots) {
    RILIEVO_RETURN_IF_ERROR(document.Item("nodes", node).status());
    if (is_taken[node]) return NodeError(node, "is in the scene twice; nodes must be a tree");
    is_taken[node] = true;
  }
  return roots;
}

}  // namespace

absl::StatusOr<std::vector<PlacedMesh>> FlattenScene(const GlbDocument& document) {
  struct Visit {
    uint64_t node;
    Eigen::Affine3d scene_from_parent;
    int depth;
  };
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint64_t> roots, RootNodes(document));
  std::vector<Visit> open;
  const auto push = [&](const std::vector<uint64_t>& nodes, const Eigen::Affine3d& parent,
                        int depth) {
    for (auto node = nodes.rbegin(); node != nodes.rend(); ++node)
      open.push_back({*node, parent, depth});
  };
  push(roots, Eigen::Affine3d::Identity(), 1);
  std::vector<PlacedMesh> placed;
  while (!open.empty()) {
    const Visit visit = open.back();
    open.pop_back();
    if (visit.depth > kMostDepth)
      return NodeError(visit.node, "is more than ", kMostDepth, " deep");
    RILIEVO_ASSIGN_OR_RETURN(const Json* node, document.Item("nodes", visit.node));
    const absl::StatusOr<Eigen::Affine3d> transform = TransformOf(*node);
    if (!transform.ok()) return NodeError(visit.node, transform.status().message());
    const Eigen::Affine3d scene_from_node = visit.scene_from_parent * *transform;
    if (GlbDocument::Find(*node, "skin") != nullptr) {
      return NodeError(visit.node, "has a skin, which is not read; export the mesh as it is posed");
    }
    if (GlbDocument::Find(*node, "mesh") != nullptr) {
      const auto mesh = GlbDocument::Whole(*node, "mesh");
      if (!mesh.ok()) return NodeError(visit.node, mesh.status().message());
      placed.push_back({*mesh, scene_from_node});
    }
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint64_t> children, NodeList(*node, "children"));
    push(children, scene_from_node, visit.depth + 1);
  }
  return placed;
}

}  // namespace rilievo
