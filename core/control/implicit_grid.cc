#include "core/control/implicit_grid.h"

#include <algorithm>

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

uint64_t ImplicitGrid::BlockKey(const Eigen::Vector3i& node) {
  uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    key = (key << kAxisBits) | static_cast<uint64_t>((node[axis] + kAxisOffset) >> kBlockBits);
  }
  return key;
}

int ImplicitGrid::FindBlock(uint64_t key) const {
  if (table_.empty()) return -1;
  const size_t mask = table_.size() - 1;
  for (size_t slot = Mix(key) & mask;; slot = (slot + 1) & mask) {
    if (table_[slot] == 0) return -1;
    if (keys_[table_[slot] - 1] == key) return table_[slot] - 1;
  }
}

int ImplicitGrid::FindOrAddBlock(uint64_t key) {
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

void ImplicitGrid::GrowTable() {
  table_.assign(std::max<size_t>(1024, table_.size() * 2), 0);
  const size_t mask = table_.size() - 1;
  for (size_t block = 0; block < keys_.size(); ++block) {
    size_t slot = Mix(keys_[block]) & mask;
    while (table_[slot] != 0) slot = (slot + 1) & mask;
    table_[slot] = static_cast<int>(block) + 1;
  }
}

void ImplicitGrid::AddBox(const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
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

void ImplicitGrid::Seal() {
  bases_.resize(masks_.size());
  size_ = 0;
  for (size_t block = 0; block < masks_.size(); ++block) {
    bases_[block] = size_;
    size_ += std::popcount(masks_[block]);
  }
}

std::vector<Eigen::Vector3i> ImplicitGrid::Nodes() const {
  constexpr uint64_t kAxisMask = (uint64_t{1} << kAxisBits) - 1;
  std::vector<Eigen::Vector3i> nodes;
  nodes.reserve(size_);
  for (size_t block = 0; block < masks_.size(); ++block) {
    Eigen::Vector3i corner;
    for (int axis = 0; axis < 3; ++axis) {
      const uint64_t part = (keys_[block] >> (kAxisBits * (2 - axis))) & kAxisMask;
      corner[axis] = static_cast<int>(part << kBlockBits) - kAxisOffset;
    }
    for (uint64_t rest = masks_[block]; rest != 0; rest &= rest - 1) {
      const int bit = std::countr_zero(rest);
      nodes.push_back(corner + Eigen::Vector3i(bit & 3, (bit >> 2) & 3, bit >> 4));
    }
  }
  return nodes;
}

}  // namespace rilievo
