#include "core/control/implicit/sparse_grid.h"

#include <algorithm>
#include <array>

#include "core/base/parallel_for_each.h"

namespace rilievo {
namespace {

constexpr int kAxisBits = 20;
constexpr int kAxisOffset = 1 << (kAxisBits - 1);

uint64_t Mix(uint64_t key) {
  key ^= key >> 31;
  key *= 0x7fb5d329728ea185ull;
  key ^= key >> 27;
  key *= 0x81dadef4bc2dd44dull;
  return key ^ (key >> 33);
}

// The bits of a block whose coordinate along `axis` lies in [low, high], 0 <= low <= high <= 3.
uint64_t AxisMask(int axis, int low, int high) {
  uint64_t mask = 0;
  for (int bit = 0; bit < 64; ++bit) {
    const int coordinate = (bit >> (2 * axis)) & 3;
    if (coordinate >= low && coordinate <= high) mask |= uint64_t{1} << bit;
  }
  return mask;
}

struct AxisMasks {
  uint64_t of[3][4][4];
  AxisMasks() {
    for (int axis = 0; axis < 3; ++axis) {
      for (int low = 0; low < 4; ++low) {
        for (int high = 0; high < 4; ++high) of[axis][low][high] = AxisMask(axis, low, high);
      }
    }
  }
};

}  // namespace

uint64_t SparseGrid::BlockKey(const Eigen::Vector3i& node) {
  uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    key = (key << kAxisBits) | static_cast<uint64_t>((node[axis] + kAxisOffset) >> kBlockBits);
  }
  return key;
}

int SparseGrid::FindBlock(uint64_t key) const {
  if (table_.empty()) return -1;
  const size_t mask = table_.size() - 1;
  for (size_t slot = Mix(key) & mask;; slot = (slot + 1) & mask) {
    if (table_[slot] == 0) return -1;
    if (keys_[table_[slot] - 1] == key) return table_[slot] - 1;
  }
}

int SparseGrid::FindOrAddBlock(uint64_t key) {
  if (table_.size() < 2 * (keys_.size() + 1)) GrowTable();
  const size_t mask = table_.size() - 1;
  for (size_t slot = Mix(key) & mask;; slot = (slot + 1) & mask) {
    if (table_[slot] == 0) {
      keys_.push_back(key);
      masks_.push_back(0);
      table_[slot] = static_cast<int>(keys_.size());
      return table_[slot] - 1;
    }
    if (keys_[table_[slot] - 1] == key) return table_[slot] - 1;
  }
}

void SparseGrid::GrowTable() {
  table_.assign(std::max<size_t>(1024, table_.size() * 2), 0);
  const size_t mask = table_.size() - 1;
  for (size_t block = 0; block < keys_.size(); ++block) {
    size_t slot = Mix(keys_[block]) & mask;
    while (table_[slot] != 0) slot = (slot + 1) & mask;
    table_[slot] = static_cast<int>(block) + 1;
  }
}

void SparseGrid::AddBox(const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
  static const AxisMasks masks;
  const auto block_of = [](int coordinate) { return coordinate >> kBlockBits; };
  const auto mask_of = [&](int axis, int block) {
    const int first = std::max(low[axis] - (block << kBlockBits), 0);
    const int last = std::min(high[axis] - (block << kBlockBits), 3);
    return masks.of[axis][first][last];
  };
  for (int bx = block_of(low.x()); bx <= block_of(high.x()); ++bx) {
    const uint64_t mask_x = mask_of(0, bx);
    for (int by = block_of(low.y()); by <= block_of(high.y()); ++by) {
      const uint64_t mask_xy = mask_x & mask_of(1, by);
      for (int bz = block_of(low.z()); bz <= block_of(high.z()); ++bz) {
        const Eigen::Vector3i corner = Eigen::Vector3i(bx, by, bz) * (1 << kBlockBits);
        masks_[FindOrAddBlock(BlockKey(corner))] |= mask_xy & mask_of(2, bz);
      }
    }
  }
}

void SparseGrid::Seal() {
  bases_.resize(masks_.size());
  size_ = 0;
  for (size_t block = 0; block < masks_.size(); ++block) {
    bases_[block] = size_;
    size_ += PopCount(masks_[block]);
  }
}

Eigen::Vector3i SparseGrid::BlockCorner(uint64_t key) {
  constexpr uint64_t kAxisMask = (uint64_t{1} << kAxisBits) - 1;
  Eigen::Vector3i corner;
  for (int axis = 0; axis < 3; ++axis) {
    const uint64_t part = (key >> (kAxisBits * (2 - axis))) & kAxisMask;
    corner[axis] = static_cast<int>(part << kBlockBits) - kAxisOffset;
  }
  return corner;
}

std::vector<Eigen::Vector3i> SparseGrid::Nodes() const {
  std::vector<Eigen::Vector3i> nodes;
  nodes.reserve(size_);
  for (size_t block = 0; block < masks_.size(); ++block) {
    const Eigen::Vector3i corner = BlockCorner(keys_[block]);
    for (uint64_t rest = masks_[block]; rest != 0; rest &= rest - 1) {
      const int bit = std::countr_zero(rest);
      nodes.push_back(corner + Eigen::Vector3i(bit & 3, (bit >> 2) & 3, bit >> 4));
    }
  }
  return nodes;
}

bool SparseGrid::FindCell(const Eigen::Vector3i& base, std::array<int, 8>* corners) const {
  return SparseGridReader(*this).FindCell(base, corners);
}

const SparseGridReader::Block& SparseGridReader::BlockAt(int which) {
  Block& block = blocks_[which];
  if (((known_ >> which) & 1) != 0) return block;
  known_ |= 1u << which;
  const Eigen::Vector3i at = home_ + Eigen::Vector3i(which & 1, (which >> 1) & 1, which >> 2);
  const int found = grid_.FindBlock(SparseGrid::BlockKey(at * (1 << SparseGrid::kBlockBits)));
  block = found < 0 ? Block{} : Block{grid_.masks_[found], grid_.bases_[found]};
  return block;
}

// Returns how many there are. Nodes of a row follow each other in their block.
template <int kSteps>
int SparseGridReader::FindBox(const Eigen::Vector3i& low, int* nodes) {
  constexpr int kBits = SparseGrid::kBlockBits;
  const Eigen::Vector3i home(low.x() >> kBits, low.y() >> kBits, low.z() >> kBits);
  if (home != home_) {
    home_ = home;
    known_ = 0;
  }
  int count = 0;
  const auto row = [&](const Block& block, int bit, int size) {
    int node = block.first_node + SparseGrid::PopCount(block.mask & ((uint64_t{1} << bit) - 1));
    for (uint64_t rest = block.mask >> bit; size > 0; --size, rest >>= 1) {
      const int is_there = static_cast<int>(rest & 1);
      *nodes++ = is_there != 0 ? node : -1;
      node += is_there;
      count += is_there;
    }
  };
  const int x = low.x() & 3, inside = std::min(kSteps, 4 - x);
  for (int step_z = 0; step_z < kSteps; ++step_z) {
    const int z = (low.z() & 3) + step_z;
    for (int step_y = 0; step_y < kSteps; ++step_y) {
      const int y = (low.y() & 3) + step_y;
      const int which = ((y >> 2) << 1) | ((z >> 2) << 2);
      const int bits = ((y & 3) << 2) | ((z & 3) << 4);
      row(BlockAt(which), bits | x, inside);
      if (inside < kSteps) row(BlockAt(which | 1), bits, kSteps - inside);
    }
  }
  return count;
}

bool SparseGridReader::FindCell(const Eigen::Vector3i& base, std::array<int, 8>* corners) {
  return FindBox<2>(base, corners->data()) == 8;
}

bool SparseGridReader::FindThreeCubed(const Eigen::Vector3i& low, std::array<int, 27>* nodes) {
  return FindBox<3>(low, nodes->data()) > 0;
}

SparseGridNeighbors::SparseGridNeighbors(const SparseGrid& grid, const RunContext& context)
    : grid_(grid), beside_(grid.masks_.size()) {
  const auto blocks = static_cast<int64_t>(beside_.size());
  ParallelForEach(blocks, kSearchBlock, context, [&](int64_t block) {
    const Eigen::Vector3i corner = SparseGrid::BlockCorner(grid_.keys_[block]);
    for (int side = 0; side < 6; ++side) {
      constexpr int kSize = 1 << SparseGrid::kBlockBits;
      Eigen::Vector3i other = corner;
      other[side >> 1] += (side & 1) != 0 ? kSize : -kSize;
      beside_[block][side] = grid_.FindBlock(SparseGrid::BlockKey(other));
    }
  }).IgnoreError();
}

SparseGridNeighbors::Numbers SparseGridNeighbors::NumbersOf(int block) const {
  Numbers numbers;
  numbers.fill(grid_.size_);
  int node = grid_.bases_[block];
  for (uint64_t rest = grid_.masks_[block]; rest != 0; rest &= rest - 1) {
    numbers[std::countr_zero(rest)] = node++;
  }
  return numbers;
}

}  // namespace rilievo
