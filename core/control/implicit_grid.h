// A sparse set of grid nodes around a surface: 4 x 4 x 4 blocks, one bit a node.
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace rilievo {

// Nodes have integer coordinates in [-2^19, 2^19). After Seal() they are numbered block by block in
// the order in which blocks were first touched, so the numbering depends on the calls alone.
class ImplicitGrid {
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
    return bases_[block] + std::popcount(masks_[block] & (bit - 1));
  }

  // Coordinates of every node, in order of their numbers.
  std::vector<Eigen::Vector3i> Nodes() const;

 private:
  static constexpr int kBlockBits = 2;
  static uint64_t BlockKey(const Eigen::Vector3i& node);
  static int BitOf(const Eigen::Vector3i& node) {
    return (node.x() & 3) | ((node.y() & 3) << 2) | ((node.z() & 3) << 4);
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

}  // namespace rilievo
