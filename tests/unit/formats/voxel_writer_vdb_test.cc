#include "client/formats/voxel_writer_vdb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/voxels/shell_voxels.h"
#include "core/voxels/solid_voxels.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

// What OpenVDB reads of one grid of floats that is not compressed.
class VdbReader {
 public:
  explicit VdbReader(std::string bytes) : bytes_(std::move(bytes)) {
    EXPECT_EQ(Take<uint64_t>(), 0x56444220u);
    EXPECT_EQ(Take<uint32_t>(), 224u);
    at_ += 2 * sizeof(uint32_t) + 1 + 36;  // library, offsets, identity
    EXPECT_EQ(Take<uint32_t>(), 0u);
    EXPECT_EQ(Take<uint32_t>(), 1u);
    name = Text();
    EXPECT_EQ(Text(), "Tree_float_5_4_3");
    EXPECT_EQ(Text(), "");
    at_ += 3 * sizeof(uint64_t);
    EXPECT_EQ(Take<uint32_t>(), 0u);
    for (auto entries = Take<uint32_t>(); entries > 0; --entries) {
      const std::string key = Text();
      EXPECT_EQ(Text(), "string");
      metadata[key] = Text();
    }
    EXPECT_EQ(Text(), "UniformScaleTranslateMap");
    for (Vector3d& vector : map) vector = {Take<double>(), Take<double>(), Take<double>()};
    EXPECT_EQ(Take<uint32_t>(), 1u);
    background = Take<float>();
    EXPECT_EQ(Take<uint32_t>(), 0u);
    for (auto roots = Take<uint32_t>(); roots > 0; --roots) {
      Vector3i origin;
      for (int axis = 0; axis < 3; ++axis) origin[axis] = Take<int32_t>();
      ReadNode(origin, 4096, 32);
    }
    for (const Vector3i& leaf : order_) ReadLeaf(leaf);
    EXPECT_EQ(at_, bytes_.size());
  }

  // Value and whether it is active.
  std::pair<float, bool> At(const Vector3i& voxel) const {
    const Vector3i in = voxel - voxel / 8 * 8;
    const auto leaf = leaves_.find(Key(8, voxel));
    if (leaf != leaves_.end())
      return leaf->second[static_cast<size_t>(64 * in.x() + 8 * in.y() + in.z())];
    for (const int side : {8, 128}) {
      const auto tile = tiles_.find(Key(side, voxel));
      if (tile != tiles_.end()) return tile->second;
    }
    return {background, false};
  }
  size_t leaves() const { return order_.size(); }

  std::string name;
  std::map<std::string, std::string> metadata;
  std::array<Vector3d, 6> map;
  float background = 0;

 private:
  template <typename T>
  T Take() {
    T value{};
    EXPECT_LE(at_ + sizeof(T), bytes_.size());
    if (at_ + sizeof(T) <= bytes_.size()) std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string Text() {
    const auto size = Take<uint32_t>();
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  std::vector<bool> Mask(size_t size) {
    std::vector<bool> mask;
    for (size_t word = 0; word < size; word += 64) {
      const auto bits = Take<uint64_t>();
      for (int bit = 0; bit < 64; ++bit) mask.push_back(bits >> bit & 1);
    }
    return mask;
  }
  static Vector3i Place(size_t index, int children) {
    const int i = static_cast<int>(index);
    return {i / (children * children), i / children % children, i % children};
  }
  using Value = std::pair<float, bool>;
  using Place4 = std::array<int, 4>;
  static Place4 Key(int side, const Vector3i& voxel) {
    return {side, voxel.x() / side, voxel.y() / side, voxel.z() / side};
  }

  void ReadNode(const Vector3i& origin, int side, int children) {
    const auto count = static_cast<size_t>(children * children * children);
    const std::vector<bool> has_child = Mask(count), active = Mask(count);
    EXPECT_EQ(Take<uint8_t>(), 6);
    const int child_side = side / children;
    for (size_t i = 0; i < count; ++i) {
      const auto value = Take<float>();
      if (has_child[i]) continue;
      tiles_[Key(child_side, origin + child_side * Place(i, children))] = {value, active[i]};
    }
    for (size_t i = 0; i < count; ++i) {
      if (!has_child[i]) continue;
      const Vector3i child = origin + child_side * Place(i, children);
      if (child_side > 8) {
        ReadNode(child, child_side, 16);
      } else {
        order_.push_back(child);
        masks_.push_back(Mask(512));
      }
    }
  }
  void ReadLeaf(const Vector3i& origin) {
    const std::vector<bool> active = Mask(512);
    EXPECT_EQ(active, masks_[read_++]);
    EXPECT_EQ(Take<uint8_t>(), 6);
    std::vector<Value>& leaf = leaves_[Key(8, origin)];
    for (size_t i = 0; i < 512; ++i) leaf.emplace_back(Take<float>(), active[i]);
  }

  std::string bytes_;
  size_t at_ = 0, read_ = 0;
  std::map<Place4, Value> tiles_;
  std::map<Place4, std::vector<Value>> leaves_;
  std::vector<Vector3i> order_;  // of the leaves in the file
  std::vector<std::vector<bool>> masks_;
};

VdbReader Written(const VoxelValues& values) {
  std::ostringstream out;
  double share = 0;
  EXPECT_TRUE(WriteVdb(
                  values, [&](double done) { share = done; }, out)
                  .ok());
  EXPECT_EQ(share, 1);
  return VdbReader(out.str());
}

TriangleMesh Tetrahedron(const Vector3d& size) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  mesh.vertices = size.asDiagonal() * mesh.vertices;
  mesh.triangles.resize(3, 4);
  mesh.triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
  return mesh;
}

void ExpectBits(const VoxelBits& bits, const VdbReader& vdb) {
  const VoxelGrid& grid = bits.grid;
  int64_t wrong = 0;
  for (int z = 0; z < grid.size.z(); ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x) {
        const bool in = bits.At(x, y, z);
        wrong += vdb.At({x, y, z}) != std::pair(in ? 1.f : 0.f, in);
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST(VoxelWriterVdbTest, SolidsAreFogWithTilesInside) {
  const TriangleMesh mesh = Tetrahedron({1, 1, 1});
  const VoxelGrid grid = *ChooseVoxelGrid(mesh, {.resolution = 60, .voxel = {}});
  const VoxelBits solid = *SolidVoxels(mesh, grid, {});
  const VdbReader vdb = Written(ValuesOf(solid, "solid of it", {}));
  EXPECT_EQ(vdb.name, "density");
  EXPECT_EQ(vdb.metadata.at("class"), "fog volume");
  EXPECT_EQ(vdb.metadata.at("creator"), "solid of it");
  EXPECT_EQ(vdb.map[0], grid.CenterOf(0, 0, 0));
  EXPECT_EQ(vdb.map[1], Vector3d::Constant(grid.voxel));
  ExpectBits(solid, vdb);
  EXPECT_GT(vdb.leaves(), 0u);
  EXPECT_LT(vdb.leaves(), 8u * 8 * 8 / 2);
}

// 4096 voxels are a node of the root.
TEST(VoxelWriterVdbTest, LongGridsHaveSeveralRoots) {
  const TriangleMesh mesh = Tetrahedron({4150, 10, 3});
  const VoxelGrid grid = *ChooseVoxelGrid(mesh, {.resolution = {}, .voxel = 1});
  const VoxelBits shell = *ShellVoxels(mesh, grid, {});
  ExpectBits(shell, Written(ValuesOf(shell, "shell", {})));
}

TEST(VoxelWriterVdbTest, DistancesAreALevelSet) {
  const TriangleMesh mesh = Tetrahedron({1, 1, 1});
  const VoxelGrid grid = *ChooseVoxelGrid(mesh, {.resolution = 70, .voxel = {}, .margin = 3});
  const VoxelDistances field = *VoxelDistances::Build(mesh, grid, 2, {});
  const VdbReader vdb = Written(ValuesOf(field, "distance", {}));
  EXPECT_EQ(vdb.name, "surface");
  EXPECT_EQ(vdb.metadata.at("class"), "level set");
  EXPECT_EQ(vdb.background, static_cast<float>(field.band()));
  const std::vector<float> expected = *field.Layers(0, grid.size.z(), {});
  int64_t wrong = 0;
  for (int z = 0; z < grid.size.z(); ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x) {
        const float value = expected[static_cast<size_t>(grid.Index(x, y, z))];
        wrong += vdb.At({x, y, z}) != std::pair(value, std::abs(value) < vdb.background);
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(vdb.At({4000, 4000, 4000}), std::pair(vdb.background, false));
}

TEST(VoxelWriterVdbTest, FailuresAreReturned) {
  VoxelValues values;
  values.grid.size = {4, 4, 4};
  values.next = [] { return absl::CancelledError("stop"); };
  std::ostringstream out;
  EXPECT_TRUE(absl::IsCancelled(WriteVdb(values, {}, out)));
}

}  // namespace
}  // namespace rilievo
