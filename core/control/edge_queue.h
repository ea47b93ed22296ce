// The edges of a simplification by what their collapse would cost.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace rilievo {

// The least of (cost, edge) comes first. A few that come next stand in line, so that the memory
// they need can be fetched ahead; the others are a heap of four children a node, over integers that
// are ordered as their costs are: half the levels of a binary heap, and no comparison to foretell.
class EdgeQueue {
 public:
  static constexpr int kLine = 12;

  bool empty() const { return line_size_ == 0 && heap_.empty(); }
  void Clear() {
    line_size_ = 0;
    heap_.clear();
  }

  // Once all of many were appended, Order() makes a queue of them; then the others serve.
  // `cost`: 0 or more.
  void Append(float cost, int edge) { heap_.push_back(KeyOf(cost, edge)); }
  void Order() {
    for (size_t place = heap_.size() / kChildren + 1; place-- > 0;) {
      if (place < heap_.size()) Sink(place, heap_[place]);
    }
    while (line_size_ < kLine && !heap_.empty()) line_[line_size_++] = PopHeap();
  }

  // The one with so many before it, at most kLine - 1; -1 where none is.
  int Edge(int before) const {
    return before < line_size_ ? static_cast<int>(line_[before] & 0xffffffff) : -1;
  }

  void RemoveFirst() {
    std::copy(line_.begin() + 1, line_.begin() + line_size_, line_.begin());
    --line_size_;
    if (!heap_.empty()) line_[line_size_++] = PopHeap();
  }

  void Push(float cost, int edge) {
    const uint64_t key = KeyOf(cost, edge);
    if (line_size_ == kLine && key > line_[kLine - 1]) return PushHeap(key);
    if (line_size_ == kLine) PushHeap(line_[--line_size_]);
    int place = line_size_++;
    for (; place > 0 && line_[place - 1] > key; --place) line_[place] = line_[place - 1];
    line_[place] = key;
  }

 private:
  static constexpr size_t kChildren = 4;

  // Floats that are not negative are in the order of their bits.
  static uint64_t KeyOf(float cost, int edge) {
    return uint64_t{std::bit_cast<uint32_t>(cost)} << 32 | static_cast<uint32_t>(edge);
  }

  void PushHeap(uint64_t key) {
    size_t place = heap_.size();
    heap_.push_back(key);
    while (place > 0) {
      const size_t parent = (place - 1) / kChildren;
      if (heap_[parent] <= key) break;
      heap_[place] = heap_[parent];
      place = parent;
    }
    heap_[place] = key;
  }

  uint64_t PopHeap() {
    const uint64_t first = heap_.front(), last = heap_.back();
    heap_.pop_back();
    if (!heap_.empty()) Sink(0, last);
    return first;
  }

  void Sink(size_t place, uint64_t key) {
    const size_t size = heap_.size();
    for (size_t child; (child = kChildren * place + 1) < size; place = child) {
      const size_t end = std::min(child + kChildren, size);
      uint64_t least = heap_[child];
      for (size_t other = child + 1; other < end; ++other) {
        const bool less = heap_[other] < least;
        least = less ? heap_[other] : least;
        child = less ? other : child;
      }
      if (key <= least) break;
      heap_[place] = least;
    }
    heap_[place] = key;
  }

  std::array<uint64_t, kLine> line_;  // ascending, none above those of the heap
  int line_size_ = 0;                 // kLine where the heap holds any
  std::vector<uint64_t> heap_;
};

}  // namespace rilievo
