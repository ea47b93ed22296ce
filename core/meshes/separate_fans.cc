#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "core/meshes/linked_triangles.h"

namespace rilievo {
namespace {

// A triangle at an edge, seen along it from its low to its high vertex.
struct Leaf {
  double angle;   // of its third corner
  bool backward;  // runs from high to low: then its solid lies at larger angles, else at smaller
  uint32_t half_edge;
  bool operator<(const Leaf& other) const {
    return std::tie(angle, backward, half_edge) <
           std::tie(other.angle, other.backward, other.half_edge);
  }
};

std::vector<Leaf> LeavesAround(int low, int high, const HalfEdgeGroup& group,
                               const LinkedTriangles& mesh) {
  const Eigen::Vector3d origin = mesh.vertices.col(low);
  const Eigen::Vector3d axis = (mesh.vertices.col(high) - origin).normalized();
  const Eigen::Vector3d right = axis.unitOrthogonal(), up = axis.cross(right);
  std::vector<Leaf> leaves(group.size());
  for (size_t i = 0; i < group.size(); ++i) {
    const uint32_t h = group[i];
    const Eigen::Vector3d arm = mesh.vertices.col(Origin(mesh.faces, PreviousHalfEdge(h))) - origin;
    leaves[i] = {std::atan2(arm.dot(up), arm.dot(right)), Origin(mesh.faces, h) != low, h};
  }
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

// Sets of corners that are one vertex.
class CornerSets {
 public:
  explicit CornerSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  uint32_t Find(uint32_t corner) {
    while (parent_[corner] != corner) {
      corner = parent_[corner] = parent_[parent_[corner]];
    }
    return corner;
  }
  // The smaller one stands for both, so that the order of the corners names the sets.
  void Unite(uint32_t a, uint32_t b) {
    a = Find(a), b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> parent_;
};

// A half-edge from `a` to `b`, and its triangle with it, become one from `a` to `middle` and a new
// one, the first of face `added`, from there to `b`.
uint32_t SplitHalfEdge(uint32_t h, int middle, int added, LinkedTriangles* mesh) {
  const uint32_t next = NextHalfEdge(h), first = 3 * static_cast<uint32_t>(added);
  const uint32_t beyond = mesh->partner[next];
  mesh->faces.col(added) << middle, Origin(mesh->faces, next),
      Origin(mesh->faces, PreviousHalfEdge(h));
  mesh->faces.data()[next] = middle;
  if (beyond != kNoHalfEdge) mesh->Link(beyond, first + 1);
  mesh->Link(next, first + 2);
  return first;
}

// One half-edge of each edge but the first between the same two vertices.
std::vector<uint32_t> RepeatedEdges(const LinkedTriangles& mesh) {
  std::vector<uint32_t> repeated;
  ForEachEdge(mesh.faces, static_cast<int>(mesh.vertices.cols()),
              [&](int, int, const HalfEdgeGroup& group) {
                const uint32_t kept = mesh.partner[group[0]];
                for (size_t i = 1; i < group.size(); ++i) {
                  const bool is_second = mesh.partner[group[i]] < group[i];
                  if (group[i] != kept && !is_second) repeated.push_back(group[i]);
                }
              });
  return repeated;
}

}  // namespace

void LinkWedges(LinkedTriangles* mesh) {
  ForEachEdge(mesh->faces, static_cast<int>(mesh->vertices.cols()),
              [&](int low, int high, const HalfEdgeGroup& group) {
                if (group.size() < 3) return;
                ++mesh->opened;
                const std::vector<Leaf> leaves = LeavesAround(low, high, group, *mesh);
                std::vector<uint32_t> open;  // backward ones that wait for theirs
                for (size_t i = 0; i < 2 * leaves.size(); ++i) {  // twice: the angle is cyclic
                  const Leaf& leaf = leaves[i % leaves.size()];
                  if (mesh->partner[leaf.half_edge] != kNoHalfEdge) continue;
                  if (!leaf.backward && !open.empty()) {
                    mesh->Link(open.back(), leaf.half_edge);
                    open.pop_back();
                  } else if (leaf.backward && i < leaves.size()) {
                    open.push_back(leaf.half_edge);
                  }
                }
              });
}

std::vector<int> SeparateFans(LinkedTriangles* mesh) {
  CornerSets sets(mesh->partner.size());
  for (uint32_t h = 0; h < mesh->partner.size(); ++h) {
    const uint32_t across = mesh->partner[h];
    if (across == kNoHalfEdge) continue;
    sets.Unite(h, NextHalfEdge(across));
    sets.Unite(NextHalfEdge(h), across);
  }
  std::vector<int> number(mesh->partner.size()), place;
  for (uint32_t h = 0; h < mesh->partner.size(); ++h) {
    const uint32_t set = sets.Find(h);
    if (set == h) {
      number[h] = static_cast<int>(place.size());
      place.push_back(Origin(mesh->faces, h));
    }
    mesh->faces.data()[h] = number[set];
  }
  mesh->vertices = Eigen::Matrix3Xd(mesh->vertices(Eigen::all, place));
  return place;
}

void SplitRepeatedEdges(LinkedTriangles* mesh, std::vector<int>* place) {
  for (;;) {
    const std::vector<uint32_t> repeated = RepeatedEdges(*mesh);
    if (repeated.empty()) return;
    auto faces = static_cast<int>(mesh->faces.cols()), vertices = static_cast<int>(place->size());
    const auto room = static_cast<int64_t>(repeated.size());
    std::vector<uint8_t> touched(static_cast<size_t>(faces + 2 * room), 1);  // the new ones wait
    std::fill_n(touched.begin(), faces, 0);
    mesh->faces.conservativeResize(3, faces + 2 * room);
    mesh->vertices.conservativeResize(3, vertices + room);
    mesh->partner.resize(static_cast<size_t>(3 * (faces + 2 * room)), kNoHalfEdge);
    for (const uint32_t h : repeated) {
      const uint32_t across = mesh->partner[h];
      if (touched[h / 3] != 0 || (across != kNoHalfEdge && touched[across / 3] != 0)) continue;
      const int a = Origin(mesh->faces, h), b = Origin(mesh->faces, NextHalfEdge(h));
      mesh->vertices.col(vertices) = (mesh->vertices.col(a) + mesh->vertices.col(b)) / 2;
      place->push_back((*place)[a]);
      touched[h / 3] = 1;
      const uint32_t behind = SplitHalfEdge(h, vertices, faces++, mesh);
      if (across != kNoHalfEdge) {
        touched[across / 3] = 1;
        const uint32_t behind_across = SplitHalfEdge(across, vertices, faces++, mesh);
        mesh->Link(h, behind_across);
        mesh->Link(across, behind);
      }
      ++vertices;
    }
    mesh->faces.conservativeResize(3, faces);
    mesh->vertices.conservativeResize(3, vertices);
    mesh->partner.resize(static_cast<size_t>(3 * faces));
  }
}

}  // namespace rilievo
