// The edges of a simplification by what their collapse would cost.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/base/key_heap.h"

namespace rilievo {

// The least of (cost, edge) comes first. A few that come next stand in line, so that the memory
// they need can be fetched ahead; the others are a heap.
class EdgeQueue {
 public:
  static constexpr int kLine = 12;

  bool empty() const { return line_size_ == 0 && heap_.empty(); }
  void Clear() {
    line_size_ = 0;
    heap_.Clear();
  }

  // Once all of many were appended, Order() makes a queue of them; then the others serve.
  // `cost`: 0 or more.
  void Append(float cost, int edge) { heap_.Append(KeyHeap::KeyOf(cost, edge)); }
  void Order() {
    heap_.Order();
    while (line_size_ < kLine && !heap_.empty()) line_[line_size_++] = heap_.Pop();
  }

  // The one with so many before it, at most kLine - 1; -1 where none is.
  int Edge(int before) const { return before < line_size_ ? KeyHeap::IndexOf(line_[before]) : -1; }

  void RemoveFirst() {
    std::copy(line_.begin() + 1, line_.begin() + line_size_, line_.begin());
    --line_size_;
    if (!heap_.empty()) line_[line_size_++] = heap_.Pop();
  }

  void Push(float cost, int edge) {
    const uint64_t key = KeyHeap::KeyOf(cost, edge);
    if (line_size_ == kLine && key > line_[kLine - 1]) return heap_.Push(key);
    if (line_size_ == kLine) heap_.Push(line_[--line_size_]);
    int place = line_size_++;
    for (; place > 0 && line_[place - 1] > key; --place) line_[place] = line_[place - 1];
    line_[place] = key;
  }

 private:
  std::array<uint64_t, kLine> line_;  // ascending, none above those of the heap
  int line_size_ = 0;                 // kLine where the heap holds any
  KeyHeap heap_;
};

}  // namespace rilievo
