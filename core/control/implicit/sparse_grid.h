// A sparse set of grid nodes around a surface: 4 x 4 x 4 blocks, one bit a node.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "core/base/run_context.h"

namespace rilievo {

// Nodes have integer coordinates in [-2^19, 2^19). After Seal() they are numbered block by block in
// the order in which blocks were first touched, so the numbering depends on the calls alone.
class SparseGrid {
 public:
  // Adds every node of the box [low, high], both ends included.
  void AddBox(const Eigen::Vector3i& low, const Eigen::Vector3i& high);

  // Ends the adding; numbers the nodes.
  void Seal();

  int size() const { return size_; }

  // Number of the node, or -1 where there is none. Only after Seal().
  int Find(const Eigen::Vector3i& node) const {
    const int block = FindBlock(BlockKey(node));
    if (block < 0) return -1;
    const uint64_t bit = uint64_t{1} << BitOf(node);
    if ((masks_[block] & bit) == 0) return -1;
    return bases_[block] + PopCount(masks_[block] & (bit - 1));
  }

  // As of SparseGridReader.
  bool FindCell(const Eigen::Vector3i& base, std::array<int, 8>* corners) const;

  // Coordinates of every node, in order of their numbers.
  std::vector<Eigen::Vector3i> Nodes() const;

 private:
  friend class SparseGridReader;
  friend class SparseGridNeighbors;
  static constexpr int kBlockBits = 2;
  static uint64_t BlockKey(const Eigen::Vector3i& node);
  static int BitOf(const Eigen::Vector3i& node) {
    return (node.x() & 3) | ((node.y() & 3) << 2) | ((node.z() & 3) << 4);
  }
  static Eigen::Vector3i BlockCorner(uint64_t key);
  // std::popcount calls a library routine on plain x86-64.
  static int PopCount(uint64_t bits) {
    bits -= (bits >> 1) & 0x5555555555555555u;
    bits = (bits & 0x3333333333333333u) + ((bits >> 2) & 0x3333333333333333u);
    bits = (bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    return static_cast<int>((bits * 0x0101010101010101u) >> 56);
  }
  int NumberIn(int block, int bit) const {
    if (block < 0 || ((masks_[block] >> bit) & 1) == 0) return -1;
    return bases_[block] + PopCount(masks_[block] & ((uint64_t{1} << bit) - 1));
  }
  int FindBlock(uint64_t key) const;
  int FindOrAddBlock(uint64_t key);
  void GrowTable();

  std::vector<uint64_t> keys_;   // per block
  std::vector<uint64_t> masks_;  // per block, one bit a node
  std::vector<int> bases_;       // per block, number of its first node
  std::vector<int> table_;       // open addressing: block + 1, 0 for empty
  int size_ = 0;
};

// Finds nodes of a sealed grid, which must outlive it. The blocks around the last place are kept:
// places that follow each other mostly ask for the same. One for each thread.
class SparseGridReader {
 public:
  explicit SparseGridReader(const SparseGrid& grid) : grid_(grid) {}

  // Numbers of the 8 corners base + (c & 1, (c >> 1) & 1, c >> 2) of a cell, -1 where there is
  // none. False when any is missing.
  bool FindCell(const Eigen::Vector3i& base, std::array<int, 8>* corners);

  // Numbers of the 27 nodes low + (x, y, z), 0 <= x, y, z <= 2, at x + 3 y + 9 z; -1 for none.
  // False when all are missing.
  bool FindThreeCubed(const Eigen::Vector3i& low, std::array<int, 27>* nodes);

 private:
  struct Block {
    uint64_t mask = 0;  // 0 where there is none
    int first_node = 0;
  };

  const Block& BlockAt(int which);
  template <int kSteps>
  int FindBox(const Eigen::Vector3i& low, int* nodes);

  const SparseGrid& grid_;
  // Of blocks_[0], in blocks; the others are one further along the axes of the bits of their
  // number.
  Eigen::Vector3i home_ = Eigen::Vector3i::Zero();
  unsigned known_ = 0;  // one bit for each of
  Block blocks_[8];
};

// The six neighbors of the nodes of a sealed grid, which must outlive it. They are found from the
// blocks as they are asked for: a table of them would take 24 bytes a node.
class SparseGridNeighbors {
 public:
  // A stop request leaves it half done; the caller asks context.CheckStop() after.
  SparseGridNeighbors(const SparseGrid& grid, const RunContext& context);

  // Calls visit(node, neighbors) for the nodes [begin, end) in order. `neighbors`: the numbers of
  // -x, +x, -y, +y, -z, +z, size() of the grid for none.
  template <typename Visit>
  void ForEach(int64_t begin, int64_t end, const Visit& visit) const;

 private:
  static constexpr int kNodesOfBlock = 64;
  using Numbers = std::array<int, kNodesOfBlock>;

  // Of the nodes of a block, by bit; size() of the grid where there is none.
  Numbers NumbersOf(int block) const;
  // The neighbor that lies in another block. `side`: 0 to 5.
  int Across(int block, int bit, int side) const {
    const int node = grid_.NumberIn(beside_[block][side], bit ^ (3 << (side & ~1)));
    return node < 0 ? grid_.size_ : node;
  }

  const SparseGrid& grid_;
  std::vector<std::array<int, 6>> beside_;  // blocks by side, -1 for none
};

template <typename Visit>
void SparseGridNeighbors::ForEach(int64_t begin, int64_t end, const Visit& visit) const {
  const std::vector<int>& bases = grid_.bases_;
  int node = static_cast<int>(begin);
  auto block = static_cast<int>(std::upper_bound(bases.begin(), bases.end(), node) - bases.begin());
  for (--block; node < end; ++block) {
    const Numbers numbers = NumbersOf(block);
    for (uint64_t rest = grid_.masks_[block]; rest != 0 && node < end; rest &= rest - 1) {
      const int bit = std::countr_zero(rest);
      if (numbers[bit] < node) continue;  // before `begin`
      std::array<int, 6> neighbors;
      for (int axis = 0; axis < 3; ++axis) {
        const int shift = 2 * axis, along = (bit >> shift) & 3;
        neighbors[2 * axis] =
            along == 0 ? Across(block, bit, 2 * axis) : numbers[bit - (1 << shift)];
        neighbors[2 * axis + 1] =
            along == 3 ? Across(block, bit, 2 * axis + 1) : numbers[bit + (1 << shift)];
      }
      visit(node++, neighbors);
    }
  }
}

}  // namespace rilievo
