// One bit for each voxel of a grid.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "core/voxels/voxel_grid.h"

namespace rilievo {

struct VoxelBits {
  VoxelGrid grid;
  std::vector<uint64_t> words;  // bit i % 64 of word i / 64 is that of voxel i; see grid.Index()

  explicit VoxelBits(const VoxelGrid& voxels)
      : grid(voxels), words(static_cast<size_t>((voxels.count() + 63) / 64)) {}

  bool At(int64_t index) const { return words[Word(index)] >> (index % 64) & 1; }
  bool At(int x, int y, int z) const { return At(grid.Index(x, y, z)); }

  int64_t Count() const {
    int64_t count = 0;
    for (const uint64_t word : words) count += std::popcount(word);
    return count;
  }

  // Several threads may look and set at once. Not std::atomic_ref, which the library of the
  // WebAssembly build lacks.
  bool AtShared(int64_t index) const {
    return __atomic_load_n(&words[Word(index)], __ATOMIC_RELAXED) >> (index % 64) & 1;
  }
  void SetShared(int64_t index) {
    __atomic_fetch_or(&words[Word(index)], uint64_t{1} << (index % 64), __ATOMIC_RELAXED);
  }

  // Sets voxels [begin, end).
  void SetRun(int64_t begin, int64_t end) {
    if (begin >= end) return;
    const uint64_t first = ~uint64_t{0} << (begin % 64);
    const uint64_t last = ~uint64_t{0} >> (63 - (end - 1) % 64);
    const size_t from = Word(begin), to = Word(end - 1);
    if (from == to) {
      words[from] |= first & last;
      return;
    }
    words[from] |= first;
    for (size_t w = from + 1; w < to; ++w) words[w] = ~uint64_t{0};
    words[to] |= last;
  }

 private:
  static size_t Word(int64_t index) { return static_cast<size_t>(index / 64); }
};

}  // namespace rilievo
