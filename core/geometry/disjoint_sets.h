// Sets that are united step by step.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace rilievo {

// Of the numbers from 0 to before `count`, each a set of its own at first.
class DisjointSets {
 public:
  explicit DisjointSets(size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0u);
  }
  uint32_t Find(uint32_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  // The smaller root stays: its sets are as flat as the input is local.
  void Unite(uint32_t i, uint32_t j) {
    i = Find(i);
    j = Find(j);
    if (i != j) parents_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<uint32_t> parents_;
};

}  // namespace rilievo
