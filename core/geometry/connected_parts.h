// The connected parts of a graph.
#pragma once

#include <cstdint>
#include <vector>

namespace rilievo {

// By node, the number of its part of those that are marked (not 0), or -1; parts are numbered in
// the order of their first nodes. `neighbors_of`(node): what it is linked to; negative numbers are
// not nodes. `count`: of the parts.
template <typename NeighborsOf>
std::vector<int> ConnectedParts(const std::vector<uint8_t>& marked, const NeighborsOf& neighbors_of,
                                int* count) {
  std::vector<int> part(marked.size(), -1), waiting;
  *count = 0;
  for (size_t seed = 0; seed < marked.size(); ++seed) {
    if (marked[seed] == 0 || part[seed] >= 0) continue;
    part[seed] = *count;
    waiting.assign(1, static_cast<int>(seed));
    while (!waiting.empty()) {
      const int node = waiting.back();
      waiting.pop_back();
      for (const int other : neighbors_of(node)) {
        if (other < 0 || marked[other] == 0 || part[other] >= 0) continue;
        part[other] = *count;
        waiting.push_back(other);
      }
    }
    ++*count;
  }
  return part;
}

}  // namespace rilievo
