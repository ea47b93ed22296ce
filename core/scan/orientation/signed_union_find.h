// Disjoint sets whose members carry a sign against each other.
#pragma once

#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace rilievo {

// Union-find where each element knows its parity (0: same sign, 1: opposite) against the root of
// its set; joins of a spanning tree so give all orientations without walking the tree.
class SignedUnionFind {
 public:
  explicit SignedUnionFind(int count) : parent_(count), parity_(count, 0), size_(count, 1) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  // The root of `element`; its parity against the root is then parity(element).
  int Find(int element) {
    int root = element;
    uint8_t to_root = 0;
    while (parent_[root] != root) {
      to_root ^= parity_[root];
      root = parent_[root];
    }
    while (parent_[element] != root && element != root) {
      const int next = parent_[element];
      const uint8_t rest = to_root ^ parity_[element];
      parent_[element] = root;
      parity_[element] = to_root;
      element = next;
      to_root = rest;
    }
    return root;
  }

  // Valid right after Find(element).
  uint8_t parity(int element) const { return parity_[element]; }

  int size(int root) const { return size_[root]; }

  // Joins the sets of a and b so that a and b differ by `opposite`. False when already one set.
  bool Join(int a, int b, uint8_t opposite) {
    int root_a = Find(a);
    int root_b = Find(b);
    if (root_a == root_b) return false;
    const uint8_t between = parity_[a] ^ parity_[b] ^ opposite;
    if (size_[root_a] < size_[root_b]) std::swap(root_a, root_b);
    parent_[root_b] = root_a;
    parity_[root_b] = between;
    size_[root_a] += size_[root_b];
    return true;
  }

 private:
  std::vector<int> parent_;
  std::vector<uint8_t> parity_;
  std::vector<int> size_;
};

}  // namespace rilievo
