#include "client/formats/voxel_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/voxels/shell_voxels.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string BytesAt(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

class VoxelWriterTest : public ::testing::Test {
 protected:
  VoxelWriterTest() {
    mesh_.vertices.resize(3, 3);
    mesh_.vertices << 10, 12, 10, 0, 0.5, 1.5, 3, 3, 4;
    mesh_.triangles = Eigen::Vector3i(0, 1, 2);
    std::string name = (std::filesystem::temp_directory_path() / "rilievo-voxels-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~VoxelWriterTest() override { std::filesystem::remove_all(folder_); }
  std::string At(const std::string& name) const { return (folder_ / name).string(); }

  TriangleMesh mesh_;
  std::filesystem::path folder_;
};

TEST_F(VoxelWriterTest, BytesAreTheBitsInTheirOrder) {
  VoxelGrid grid;  // of more than one block, and no whole number of words
  grid.origin = {9.9, -0.1, 2.9};
  grid.voxel = 0.02;
  grid.size = {150, 151, 101};
  const auto shell = ShellVoxels(mesh_, grid, {});
  ASSERT_TRUE(shell.ok()) << shell.status();
  ASSERT_GT(grid.count(), int64_t{1} << 21);
  ASSERT_NE(grid.count() % 64, 0);
  double last = 0;
  const auto follow = [&](double share) {
    EXPECT_GT(share, last);
    last = share;
  };
  ASSERT_TRUE(WriteVoxels(At("a.raw"), "raw", ValuesOf(*shell, "shell", {}), "", follow).ok());
  EXPECT_EQ(last, 1);
  const std::string bytes = BytesAt(At("a.raw"));
  ASSERT_EQ(static_cast<int64_t>(bytes.size()), grid.count());
  int64_t wrong = 0;
  for (int64_t i = 0; i < grid.count(); ++i) {
    wrong += bytes[static_cast<size_t>(i)] != static_cast<char>(shell->At(i));
  }
  EXPECT_EQ(wrong, 0);
}

TEST_F(VoxelWriterTest, NrrdHeadersTellTheGrid) {
  VoxelGrid grid;
  grid.origin = {9.5, -0.5, 2};
  grid.voxel = 0.5;
  grid.size = {8, 6, 5};
  const auto shell = ShellVoxels(mesh_, grid, {});
  ASSERT_TRUE(shell.ok()) << shell.status();
  ASSERT_TRUE(
      WriteVoxels(At("a.nrrd"), "nrrd", ValuesOf(*shell, "shell of it", {}), "mm", {}).ok());
  const std::string text = BytesAt(At("a.nrrd"));
  const std::string header =
      "NRRD0004\ncontent: shell of it\ntype: uint8\ndimension: 3\nspace dimension: 3\n"
      "sizes: 8 6 5\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,0.5)\n"
      "space origin: (9.75,-0.25,2.25)\nkinds: domain domain domain\n"
      "centerings: cell cell cell\nspace units: \"mm\" \"mm\" \"mm\"\nencoding: raw\n\n";
  ASSERT_EQ(text.substr(0, header.size()), header);
  EXPECT_EQ(text.size(), header.size() + 240);
}

TEST_F(VoxelWriterTest, DistancesAreFloats) {
  const int band = 2;
  const VoxelGrid grid =
      ChooseVoxelGrid(mesh_, {.resolution = 11, .voxel = {}, .margin = band + 1}).value();
  const auto field = VoxelDistances::Build(mesh_, grid, band, {});
  ASSERT_TRUE(field.ok()) << field.status();
  ASSERT_TRUE(WriteVoxels(At("a.nrrd"), "nrrd", ValuesOf(*field, "distance", {}), "", {}).ok());
  const std::string text = BytesAt(At("a.nrrd"));
  EXPECT_THAT(text, HasSubstr("\ntype: float\n"));
  EXPECT_THAT(text, HasSubstr("\nendian: "));
  EXPECT_THAT(text.substr(0, 400), Not(HasSubstr("units")));
  const size_t begin = text.find("\n\n") + 2;
  std::vector<float> written(static_cast<size_t>(grid.count()));
  ASSERT_EQ(text.size() - begin, written.size() * sizeof(float));
  std::memcpy(written.data(), text.data() + begin, text.size() - begin);
  EXPECT_EQ(written, field->Layers(0, grid.size.z(), {}).value());
}

TEST_F(VoxelWriterTest, WhatFailsLeavesTheOldFile) {
  std::ofstream(At("a.raw")) << "old";
  VoxelValues values;
  values.grid.size = {4, 4, 4};
  values.next = [] { return absl::CancelledError("stop"); };
  EXPECT_TRUE(absl::IsCancelled(WriteVoxels(At("a.raw"), "raw", values, "", {})));
  EXPECT_EQ(BytesAt(At("a.raw")), "old");
  EXPECT_EQ(WriteVoxels(At("a.vti"), "vti", values, "", {}).code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
