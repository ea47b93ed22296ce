// Half-edges of a triangle list, and the groups of them that share an edge.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace rilievo {

// Half-edge 3 f + k runs from corner k of face f to corner (k + 1) % 3.
inline constexpr uint32_t kNoHalfEdge = 0xffffffffu;

inline uint32_t NextHalfEdge(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline uint32_t PreviousHalfEdge(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
inline int Origin(const Eigen::Matrix3Xi& faces, uint32_t h) { return faces.data()[h]; }

// The half-edges of one edge, ascending.
class HalfEdgeGroup {
 public:
  explicit HalfEdgeGroup(std::span<const uint64_t> entries) : entries_(entries) {}
  size_t size() const { return entries_.size(); }
  uint32_t operator[](size_t i) const { return static_cast<uint32_t>(entries_[i]); }

 private:
  std::span<const uint64_t> entries_;
};

// Calls visit(low, high, group) for each edge, in ascending order of (low, high) vertex. Indices
// must lie in [0, vertex_count) and differ within a face. A counting sort on the low vertex, then a
// sort of each vertex' few entries by high vertex: no worst case beyond n log n, whatever the
// valences.
template <typename Visit>
void ForEachEdge(const Eigen::Matrix3Xi& faces, int vertex_count, const Visit& visit) {
  const uint32_t half_edge_count = static_cast<uint32_t>(3 * faces.cols());
  std::vector<uint32_t> cursor(static_cast<size_t>(vertex_count) + 1, 0);
  const auto ends = [&faces](uint32_t h) {
    return std::minmax({Origin(faces, h), Origin(faces, NextHalfEdge(h))});
  };
  for (uint32_t h = 0; h < half_edge_count; ++h) ++cursor[ends(h).first];
  uint32_t sum = 0;
  for (uint32_t& c : cursor) {
    const uint32_t count = c;
    c = sum;
    sum += count;
  }
  std::vector<uint64_t> entries(half_edge_count);
  for (uint32_t h = 0; h < half_edge_count; ++h) {
    const auto [low, high] = ends(h);
    entries[cursor[low]++] = static_cast<uint64_t>(high) << 32 | h;
  }
  uint32_t begin = 0;  // after the pass above cursor[low] is where the entries of `low` end
  for (int low = 0; low < vertex_count; ++low) {
    const uint32_t end = cursor[low];
    std::sort(entries.begin() + begin, entries.begin() + end);
    while (begin < end) {
      const uint32_t first = begin;
      const uint64_t high = entries[first] >> 32;
      while (begin < end && entries[begin] >> 32 == high) ++begin;
      visit(low, static_cast<int>(high),
            HalfEdgeGroup(std::span(entries).subspan(first, begin - first)));
    }
  }
}

}  // namespace rilievo
