// A folder in which a run finds what one before it has finished.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/codec/bytes/saved_value.h"
#include "core/paging/scan_pager.h"
#include "core/paging/scratch_blocks.h"
#include "core/paging/scratch_file.h"
#include "core/paging/scratch_folder.h"
#include "core/paging/scratch_surfels.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<uint8_t>;

class KeptScratchTest : public ::testing::Test {
 protected:
  KeptScratchTest() {
    std::string name = (fs::path(::testing::TempDir()) / "kept-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~KeptScratchTest() override { fs::remove_all(path_); }

  KeptScratch Open(const std::string& identity = "a run") const {
    return KeptScratch::Open(path_, identity).value();
  }
  // Turns a bit of byte `at` of a file of the run.
  static void Damage(const KeptScratch& scratch, const std::string& name, int64_t at) {
    std::fstream file(scratch.folder().path() + "/" + name,
                      std::ios::in | std::ios::out | std::ios::binary);
    ASSERT_TRUE(file.is_open());
    file.seekg(at);
    const auto byte = static_cast<char>(file.get() ^ 1);
    file.seekp(at);
    file.put(byte);
  }

  std::string path_;
};

TEST_F(KeptScratchTest, FindsWhatWasSavedLast) {
  {
    const KeptScratch scratch = Open();
    EXPECT_FALSE(scratch.folder().Load("x").has_value());
    ASSERT_TRUE(scratch.folder().Save("x", Bytes{1, 2, 3}).ok());
    ASSERT_TRUE(scratch.folder().Save("x", Bytes{4, 5}).ok());
  }
  KeptScratch again = Open();
  EXPECT_EQ(again.folder().Load("x"), (Bytes{4, 5}));
  Damage(again, "x", 1);
  EXPECT_FALSE(again.folder().Load("x").has_value());
  EXPECT_FALSE(Open("another run").folder().Load("x").has_value());
  const std::string folder = again.folder().path();
  EXPECT_TRUE(fs::exists(folder));
  again.Remove();
  EXPECT_FALSE(fs::exists(folder));
}

TEST_F(KeptScratchTest, IsOfOneProcessAtATime) {
  const KeptScratch scratch = Open();
  const absl::Status status = KeptScratch::Open(path_, "a run").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), ::testing::HasSubstr("another process"));
}

TEST_F(KeptScratchTest, FilesOfARunAreNoLinks) {
  const KeptScratch scratch = Open();
  const std::string folder = scratch.folder().path(), other = path_ + "/other";
  std::ofstream(other) << "of somebody else";
  const auto is_refused = [&](const absl::Status& status) {
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied);
    EXPECT_THAT(status.message(), ::testing::HasSubstr(folder));
    EXPECT_THAT(status.message(), ::testing::HasSubstr("symbolic link"));
    EXPECT_TRUE(IsOfScratchFolder(status));
  };
  fs::create_symlink(other, folder + "/parts");
  is_refused(ScratchBlocks::Create(scratch.folder(), "parts", 1, 8).status());
  fs::create_symlink(other, folder + "/x.new");
  is_refused(scratch.folder().Save("x", Bytes{1}));
  fs::create_symlink(other, folder + "/y");
  EXPECT_FALSE(scratch.folder().Load("y").has_value());
  EXPECT_EQ(fs::file_size(other), 16u);
}

TEST_F(KeptScratchTest, FolderIsOfThisUserAlone) {
  const std::string folder = Open().folder().path();
  const auto is_refused = [&](const std::string& why) {
    const absl::Status status = KeptScratch::Open(path_, "a run").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied);
    EXPECT_THAT(status.message(), ::testing::HasSubstr(folder + " " + why));
    EXPECT_TRUE(IsOfScratchFolder(status));
  };
  ASSERT_EQ(chmod(folder.c_str(), 0770), 0);
  is_refused("may be written to by other users");
  ASSERT_EQ(chmod(folder.c_str(), 0700), 0);
  if (geteuid() == 0) {
    constexpr uid_t kNobody = 65534;
    ASSERT_EQ(chown(folder.c_str(), kNobody, kNobody), 0);
    is_refused("belongs to another user");
  }
  fs::rename(folder, path_ + "/elsewhere");
  fs::create_directory_symlink(path_ + "/elsewhere", folder);
  is_refused("is a symbolic link");
}

TEST_F(KeptScratchTest, FindsPagesUnlessOneIsDamaged) {
  const KeptScratch scratch = Open();
  EXPECT_FALSE(FindPagedScan(scratch.folder(), RunContext{})->has_value());
  ScanPager pager = ScanPager::Create(scratch.folder(), 3000).value();
  ASSERT_TRUE(pager.Add(SphereCloud(9000, 3).cloud.points).ok());
  const PagedScan scan = pager.Finish(RunContext{}).value();
  {
    const std::optional<PagedScan> found = FindPagedScan(scratch.folder(), RunContext{}).value();
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->size(), scan.size());
    EXPECT_EQ(found->cells(), scan.cells());
    EXPECT_EQ(found->curve().diagonal, scan.curve().diagonal);
    EXPECT_EQ(found->figures().points_in, 9000);
    for (int page = 0; page < 3; ++page) {
      EXPECT_EQ(found->Read(page).value(), scan.Read(page).value());
      EXPECT_EQ(found->pages()[page].box.min(), scan.pages()[page].box.min());
      EXPECT_EQ(found->pages()[page].box.max(), scan.pages()[page].box.max());
      const Eigen::AlignedBox3d near = scan.pages()[page].stretches.back().box;
      EXPECT_EQ(found->pages()[page].PointsNear(near), scan.pages()[page].PointsNear(near));
    }
  }
  Damage(scratch, "pages", int64_t{kPagePoints} * 24 + 100);
  EXPECT_FALSE(FindPagedScan(scratch.folder(), RunContext{})->has_value());
}

TEST_F(KeptScratchTest, CellsOfOtherPointsAreNotBelieved) {
  const KeptScratch scratch = Open();
  ScanPager pager = ScanPager::Create(scratch.folder()).value();
  ASSERT_TRUE(pager.Add(SphereCloud(9000, 3).cloud.points).ok());
  const PagedScan scan = pager.Finish(RunContext{}).value();
  const auto with_cells = [&](const CellCounts& cells) {
    ScratchFile file = ScratchFile::Create(scratch.folder(), "pages").value();
    EXPECT_TRUE(
        PagedScan(std::move(file), scan.pages(), scan.size(), scan.curve(), cells, scan.figures())
            .Save()
            .ok());
    return FindPagedScan(scratch.folder(), RunContext{}).value();
  };
  CellCounts cells = scan.cells();
  EXPECT_TRUE(with_cells(cells)->Thinned(100, {}, RunContext{}).ok());
  cells.back() = -1;
  EXPECT_FALSE(with_cells(cells).has_value());
  cells.fill(1);
  const absl::Status status = with_cells(cells)->Thinned(100, {}, RunContext{}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), ::testing::HasSubstr(scratch.folder().path()));
}

TEST_F(KeptScratchTest, BlocksAreThereAsAnEarlierRunHasWrittenThem) {
  const KeptScratch scratch = Open();
  const auto open = [&](int count) {
    return ScratchBlocks::Create(scratch.folder(), "blocks", count, 8).value();
  };
  {
    ScratchBlocks blocks = open(4);
    ASSERT_TRUE(blocks.Write(0, Bytes{1, 2, 3}).ok());
    ASSERT_TRUE(blocks.Write(2, Bytes{4}).ok());
    ASSERT_TRUE(blocks.Write(3, Bytes(8, 5)).ok());
  }
  Damage(scratch, "blocks", 2 * 16 + 8);
  Damage(scratch, "blocks", 3 * 16 + 3);  // a length beyond the room
  const ScratchBlocks blocks = open(4);
  EXPECT_EQ(blocks.Read(0).value(), (Bytes{1, 2, 3}));
  EXPECT_TRUE(blocks.Read(1)->empty());
  EXPECT_EQ(blocks.Read(2).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_TRUE(blocks.Read(3)->empty());
  EXPECT_TRUE(open(5).Read(0)->empty()) << "of another number of blocks";
}

TEST_F(KeptScratchTest, PagesWhoseSurfelsAreDamagedAreNotThere) {
  const KeptScratch scratch = Open();
  ScanPager pager = ScanPager::Create(scratch.folder()).value();
  ASSERT_TRUE(pager.Add(SphereCloud(9000, 3).cloud.points).ok());
  const PagedScan scan = pager.Finish(RunContext{}).value();
  {
    ScratchSurfels surfels = ScratchSurfels::Create(scan).value();
    EXPECT_FALSE(surfels.Has(0));
    for (const int page : {0, 1}) {
      const Surfel surfel{{0, 0, 1}, 0.5f, 0.1f};
      ASSERT_TRUE(surfels.Write(page, std::vector<Surfel>(kPagePoints, surfel)).ok());
    }
    // Nobody has made such a one.
    const float endless = std::numeric_limits<float>::infinity();
    const Surfel impossible{{0, 0, 1}, endless, 0.1f};
    ASSERT_TRUE(surfels.Write(2, std::vector<Surfel>(9000 - 2 * kPagePoints, impossible)).ok());
  }
  const auto there = [&] {
    const ScratchSurfels surfels = ScratchSurfels::Create(scan).value();
    return std::vector<bool>{surfels.Has(0), surfels.Has(1), surfels.Has(2)};
  };
  EXPECT_EQ(there(), (std::vector<bool>{true, true, false}));
  EXPECT_EQ(ScratchSurfels::Create(scan)->Read(1).value()[5000 % kPagePoints].spacing, 0.5f);
  Damage(scratch, "surfels", 5001 * 20 + 13);
  EXPECT_EQ(there(), (std::vector<bool>{true, false, false}));
}

TEST(SavedValue, ComesBackUnlessBytesAreMissing) {
  const auto visit = [](auto& archive, auto& number, auto& text, auto& list, auto& columns) {
    archive(number);
    archive(text);
    archive(list);
    archive(columns);
  };
  const double number = 2.5;
  const std::string text = "two";
  const std::vector<float> list = {1, 2, 3};
  const Eigen::Matrix3Xd columns = Eigen::Matrix3Xd::Random(3, 5);
  ValueWriter writer;
  visit(writer, number, text, list, columns);
  for (size_t bytes = 0; bytes <= writer.bytes.size(); ++bytes) {
    double read_number = 0;
    std::string read_text;
    std::vector<float> read_list;
    Eigen::Matrix3Xd read_columns;
    ValueReader reader(std::span(writer.bytes).first(bytes));
    visit(reader, read_number, read_text, read_list, read_columns);
    EXPECT_EQ(reader.Finished(), bytes == writer.bytes.size());
    if (!reader.Finished()) continue;
    EXPECT_EQ(read_number, number);
    EXPECT_EQ(read_text, text);
    EXPECT_EQ(read_list, list);
    EXPECT_EQ(read_columns, columns);
  }
}

}  // namespace
}  // namespace rilievo
