// Rings around the vertices of a level, from a table or from the level before.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/loop/edge_star.h"

namespace rilievo {

// Neighbours of a vertex in the order of VertexRings.
class Ring {
 public:
  explicit Ring(std::span<const int> stored) : stored_(stored.data()), size_(stored.size()) {}
  Ring(const std::array<int, 6>& own, size_t size) : size_(size), own_(own) {}
  int size() const { return static_cast<int>(size_); }
  const int* begin() const { return stored_ != nullptr ? stored_ : own_.data(); }
  const int* end() const { return begin() + size_; }
  int operator[](int place) const { return begin()[place]; }

 private:
  const int* stored_ = nullptr;
  size_t size_;
  std::array<int, 6> own_;
};

// Asked by a copy, too, for as long as what it was made of lives.
class LevelRings {
 public:
  // Of `table`.
  LevelRings(const VertexRings& table) : table_(&table) {}  // NOLINT(google-explicit-constructor)
  // Of the level after `parent`, which is asked at every call: they take a fifth of a table's
  // memory, and the level's own faces need not exist.
  static LevelRings After(const MeshTopology& parent);

  Ring Of(int vertex) const {
    if (parent_ == nullptr) return Ring(Listed(*table_, vertex));
    if (vertex < parent_->vertex_count) return Ring(Listed(*old_vertices_, vertex));
    return OfEdge(vertex - parent_->vertex_count);
  }

 private:
  LevelRings() = default;
  static std::span<const int> Listed(const VertexRings& rings, int vertex) {
    const int begin = rings.neighbor_begin[vertex];
    return {rings.neighbors.data() + begin,
            static_cast<size_t>(rings.neighbor_begin[vertex + 1] - begin)};
  }
  Ring OfEdge(int edge) const;

  const VertexRings* table_ = nullptr;
  const MeshTopology* parent_ = nullptr;
  std::shared_ptr<const VertexRings> old_vertices_;
};

}  // namespace rilievo
