#include "client/formats/voxel_writer_vdb.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/formats/block_writer.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int kSide = 8;  // voxels of a block
constexpr int kBlockVoxels = kSide * kSide * kSide;
constexpr int kLowerSide = 16, kUpperSide = 32;  // children of the two kinds of nodes
constexpr uint8_t kAllValues = 6;                // OpenVDB's NO_MASK_AND_ALL_VALS

struct Block {
  std::array<float, kBlockVoxels> values;  // z fastest
  std::bitset<kBlockVoxels> active;
};

// The blocks of a grid, x fastest. Those whose voxels are all alike are a value alone.
struct BlockGrid {
  Eigen::Vector3i size;         // in blocks
  std::vector<int32_t> stored;  // in `blocks`, -1: none
  std::vector<float> value;
  std::vector<bool> active;
  std::vector<Block> blocks;

  bool Has(const Eigen::Vector3i& at) const { return (at.array() < size.array()).all(); }
  size_t Index(const Eigen::Vector3i& at) const {
    return (static_cast<size_t>(at.z()) * static_cast<size_t>(size.y()) +
            static_cast<size_t>(at.y())) *
               static_cast<size_t>(size.x()) +
           static_cast<size_t>(at.x());
  }
};

// The voxels of up to eight layers, as they come.
class LayerReader {
 public:
  explicit LayerReader(const VoxelValues& values) : values_(values) {}

  absl::Status Read(int layers) {
    const auto bytes = static_cast<size_t>(values_.grid.Index(0, 0, layers) * values_.bytes);
    bytes_.erase(0, used_);
    while (bytes_.size() < bytes) {
      RILIEVO_ASSIGN_OR_RETURN(const std::string_view more, values_.next());
      bytes_.append(more);
    }
    used_ = bytes;
    return absl::OkStatus();
  }

  float At(int x, int y, int layer) const {
    const auto index = static_cast<size_t>(values_.grid.Index(x, y, layer));
    if (values_.bytes == 1) return bytes_[index];
    float value;
    std::memcpy(&value, bytes_.data() + index * sizeof(float), sizeof(float));
    return value;
  }

 private:
  const VoxelValues& values_;
  std::string bytes_;
  size_t used_ = 0;
};

// Voxels beyond the grid are background.
Block BlockAt(const Eigen::Vector3i& at, const VoxelValues& values, const LayerReader& layers) {
  Block block;
  block.values.fill(values.background);
  const Eigen::Vector3i first = kSide * at;
  const Eigen::Vector3i last = (first.array() + kSide).min(values.grid.size.array());
  for (int x = first.x(); x < last.x(); ++x) {
    for (int y = first.y(); y < last.y(); ++y) {
      for (int z = first.z(); z < last.z(); ++z) {
        const auto i =
            static_cast<size_t>(((x - first.x()) * kSide + y - first.y()) * kSide + z - first.z());
        block.values[i] = layers.At(x, y, z - first.z());
        // Beyond a band there are values of both signs, and none of them is active.
        block.active[i] = values.bytes == 1 ? block.values[i] != 0
                                            : std::abs(block.values[i]) < values.background;
      }
    }
  }
  return block;
}

absl::StatusOr<BlockGrid> ReadBlocks(const VoxelValues& values,
                                     const std::function<void(double share)>& progress) {
  BlockGrid grid;
  grid.size = (values.grid.size.array() + kSide - 1) / kSide;
  const auto count = static_cast<size_t>(grid.size.cast<int64_t>().prod());
  grid.stored.assign(count, -1);
  grid.value.assign(count, values.background);
  grid.active.assign(count, false);
  LayerReader layers(values);
  for (int z = 0; z < grid.size.z(); ++z) {
    RILIEVO_RETURN_IF_ERROR(layers.Read(std::min(kSide, values.grid.size.z() - kSide * z)));
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x) {
        const Block block = BlockAt({x, y, z}, values, layers);
        const size_t index = grid.Index({x, y, z});
        const bool alike =
            (block.active.all() || block.active.none()) &&
            std::all_of(block.values.begin(), block.values.end(),
                        [&block](float value) { return value == block.values.front(); });
        if (alike) {
          grid.value[index] = block.values.front();
          grid.active[index] = block.active.all();
        } else {
          grid.stored[index] = static_cast<int32_t>(grid.blocks.size());
          grid.blocks.push_back(block);
        }
      }
    }
    if (progress) progress((z + 1.0) / grid.size.z());
  }
  return grid;
}

class VdbFile {
 public:
  VdbFile(const VoxelValues& values, const BlockGrid& grid, std::ostream& out)
      : values_(values), grid_(grid), out_(out) {}

  void Write() {
    WriteHeader();
    WriteMetadata();
    WriteTransform();
    out_.Little(uint32_t{1});  // buffers
    out_.Little(values_.background);
    out_.Little(uint32_t{0});  // tiles of the root
    constexpr int kLeaves = kLowerSide * kUpperSide;
    const Eigen::Vector3i roots = (grid_.size.array() + kLeaves - 1) / kLeaves;
    out_.Little(static_cast<uint32_t>(roots.prod()));
    ForEachIn(roots, [&](const Eigen::Vector3i& root) {
      for (int axis = 0; axis < 3; ++axis) out_.Little(int32_t{kSide * kLeaves * root[axis]});
      WriteUpper(kLeaves * root);
    });
    // The blocks once more, in the same order, with their values.
    for (const int32_t stored : order_) {
      const Block& block = grid_.blocks[static_cast<size_t>(stored)];
      WriteMask(block.active);
      out_.Little(kAllValues);
      for (const float value : block.values) out_.Little(value);
    }
  }

 private:
  // z fastest, as in the file.
  template <typename Visit>
  static void ForEachIn(const Eigen::Vector3i& size, const Visit& visit) {
    for (int x = 0; x < size.x(); ++x) {
      for (int y = 0; y < size.y(); ++y) {
        for (int z = 0; z < size.z(); ++z) visit(Eigen::Vector3i(x, y, z));
      }
    }
  }

  void WriteText(std::string_view text) {
    out_.Little(static_cast<uint32_t>(text.size()));
    out_.text() += text;
  }

  template <size_t kBits>
  void WriteMask(const std::bitset<kBits>& mask) {
    for (size_t word = 0; word < kBits; word += 64) {
      uint64_t bits = 0;
      for (size_t bit = 0; bit < 64; ++bit) bits |= uint64_t{mask[word + bit]} << bit;
      out_.Little(bits);
    }
  }

  void WriteHeader() {
    out_.Little(uint64_t{0x56444220});
    out_.Little(uint32_t{224});                              // file version
    for (const uint32_t part : {9u, 0u}) out_.Little(part);  // of the library
    out_.Little(uint8_t{0});                                 // no offsets
    out_.text() += "72696c69-6576-6f00-8000-766f78656c73";
    out_.Little(uint32_t{0});  // metadata of the file
    out_.Little(uint32_t{1});  // grids
    WriteText(values_.name);
    WriteText("Tree_float_5_4_3");
    WriteText("");                                         // of another grid
    for (int i = 0; i < 3; ++i) out_.Little(uint64_t{0});  // offsets
    out_.Little(uint32_t{0});                              // not compressed
  }

  void WriteMetadata() {
    const std::pair<std::string_view, std::string_view> entries[] = {
        {"class", values_.grid_class}, {"name", values_.name}, {"creator", values_.content}};
    out_.Little(static_cast<uint32_t>(std::size(entries)));
    for (const auto& [name, text] : entries) {
      WriteText(name);
      WriteText("string");
      WriteText(text);
    }
  }

  // Voxel (0, 0, 0) of OpenVDB has its centre at index (0, 0, 0).
  void WriteTransform() {
    const double voxel = values_.grid.voxel;
    WriteText("UniformScaleTranslateMap");
    const auto write = [&](const Eigen::Vector3d& vector) {
      for (const double number : {vector.x(), vector.y(), vector.z()}) out_.Little(number);
    };
    write(values_.grid.CenterOf(0, 0, 0));
    for (const double number : {voxel, voxel, 1 / voxel, 1 / (voxel * voxel), 0.5 / voxel}) {
      write(Eigen::Vector3d::Constant(number));
    }
  }

  // A node of nodes, whose first block is `first`.
  void WriteUpper(const Eigen::Vector3i& first) {
    constexpr size_t kChildren = size_t{kUpperSide} * kUpperSide * kUpperSide;
    std::bitset<kChildren> children;
    size_t i = 0;
    ForEachIn(Eigen::Vector3i::Constant(kUpperSide), [&](const Eigen::Vector3i& child) {
      children[i++] = grid_.Has(first + kLowerSide * child);
    });
    WriteMask(children);
    WriteMask(std::bitset<kChildren>());
    out_.Little(kAllValues);
    for (i = 0; i < kChildren; ++i) out_.Little(children[i] ? 0.f : values_.background);
    ForEachIn(Eigen::Vector3i::Constant(kUpperSide), [&](const Eigen::Vector3i& child) {
      if (grid_.Has(first + kLowerSide * child)) WriteLower(first + kLowerSide * child);
    });
  }

  // A node of blocks.
  void WriteLower(const Eigen::Vector3i& first) {
    constexpr size_t kChildren = size_t{kLowerSide} * kLowerSide * kLowerSide;
    std::bitset<kChildren> children, active;
    std::vector<float> values(kChildren, values_.background);
    std::vector<int32_t> stored;
    size_t i = 0;
    ForEachIn(Eigen::Vector3i::Constant(kLowerSide), [&](const Eigen::Vector3i& child) {
      const size_t at = i++;
      if (!grid_.Has(first + child)) return;
      const size_t index = grid_.Index(first + child);
      children[at] = grid_.stored[index] >= 0;
      active[at] = grid_.active[index];
      values[at] = children[at] ? 0 : grid_.value[index];
      if (children[at]) stored.push_back(grid_.stored[index]);
    });
    WriteMask(children);
    WriteMask(active);
    out_.Little(kAllValues);
    for (const float value : values) out_.Little(value);
    for (const int32_t block : stored) WriteMask(grid_.blocks[static_cast<size_t>(block)].active);
    order_.insert(order_.end(), stored.begin(), stored.end());
  }

  const VoxelValues& values_;
  const BlockGrid& grid_;
  BlockWriter out_;
  std::vector<int32_t> order_;  // of the blocks in the file
};

}  // namespace

absl::Status WriteVdb(const VoxelValues& values, const std::function<void(double share)>& progress,
                      std::ostream& out) {
  RILIEVO_ASSIGN_OR_RETURN(const BlockGrid grid, ReadBlocks(values, progress));
  VdbFile(values, grid, out).Write();
  return absl::OkStatus();
}

}  // namespace rilievo
