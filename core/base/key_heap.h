// A priority queue of integers, least first.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace rilievo {

// A heap of four children a node: half the levels of a binary one, and no comparison to foretell.
class KeyHeap {
 public:
  // In the order of `value`, 0 or more, and of `index` where values are equal: floats that are not
  // negative are in the order of their bits.
  static uint64_t KeyOf(float value, int index) {
    return uint64_t{std::bit_cast<uint32_t>(value)} << 32 | static_cast<uint32_t>(index);
  }
  static float ValueOf(uint64_t key) {
    return std::bit_cast<float>(static_cast<uint32_t>(key >> 32));
  }
  static int IndexOf(uint64_t key) { return static_cast<int>(static_cast<uint32_t>(key)); }

  bool empty() const { return keys_.empty(); }
  void Clear() { keys_.clear(); }
  void Reserve(size_t size) { keys_.reserve(size); }

  // Once all of many were appended, Order() makes a heap of them; then the others serve.
  void Append(uint64_t key) { keys_.push_back(key); }
  void Order() {
    for (size_t place = keys_.size() / kChildren + 1; place-- > 0;) {
      if (place < keys_.size()) Sink(place, keys_[place]);
    }
  }

  void Push(uint64_t key) {
    size_t place = keys_.size();
    keys_.push_back(key);
    while (place > 0) {
      const size_t parent = (place - 1) / kChildren;
      if (keys_[parent] <= key) break;
      keys_[place] = keys_[parent];
      place = parent;
    }
    keys_[place] = key;
  }

  // The least; there must be one.
  uint64_t First() const { return keys_.front(); }
  uint64_t Pop() {
    const uint64_t first = keys_.front(), last = keys_.back();
    keys_.pop_back();
    if (!keys_.empty()) Sink(0, last);
    return first;
  }

 private:
  static constexpr size_t kChildren = 4;

  void Sink(size_t place, uint64_t key) {
    const size_t size = keys_.size();
    for (size_t child; (child = kChildren * place + 1) < size; place = child) {
      const size_t end = std::min(child + kChildren, size);
      uint64_t least = keys_[child];
      for (size_t other = child + 1; other < end; ++other) {
        const bool less = keys_[other] < least;
        least = less ? keys_[other] : least;
        child = less ? other : child;
      }
      if (key <= least) break;
      keys_[place] = least;
    }
    keys_[place] = key;
  }

  std::vector<uint64_t> keys_;
};

}  // namespace rilievo
