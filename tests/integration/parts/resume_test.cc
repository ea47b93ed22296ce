// A scan on disk whose run is killed, and goes on.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "core/paging/scan_pager.h"
#include "core/paging/scratch_blocks.h"
#include "core/paging/scratch_folder.h"
#include "core/pipeline/reconstruct.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

class ResumeTest : public ::testing::Test {
 protected:
  ResumeTest() {
    std::string name = (fs::path(::testing::TempDir()) / "resume-XXXXXX").string();
    path_ = mkdtemp(name.data());
    ScannerOptions options;
    options.points = 12000;
    options.views = 0;
    points_ = SimulateScan(*MakeShape("torus").value(), options).value().cloud.points;
  }
  ~ResumeTest() override { fs::remove_all(path_); }

  // What the program does, on one thread.
  std::vector<uint8_t> Run(const std::function<void(const Progress&)>& progress = {}) const {
    RunContext context;
    context.threads = 1;
    context.progress = progress;
    const KeptScratch scratch = KeptScratch::Open(path_, "torus").value();
    std::optional<PagedScan> scan = FindPagedScan(scratch.folder(), context).value();
    if (!scan) {
      ScanPager pager = ScanPager::Create(scratch.folder(), 5000).value();
      EXPECT_TRUE(pager.Add(points_).ok());
      scan = pager.Finish(context).value();
    }
    const PartSizes sizes{.coarse_points = 4000, .part_points = 8192, .block_vertices = 4000};
    return ReconstructPaged(*scan, sizes, {}, context)->encoded.Concatenate();
  }

  // In a process that is killed as soon as it has reported what `is_time` waits for.
  void RunUntil(const std::function<bool(const Progress&)>& is_time) const {
    const pid_t child = fork();
    if (child == 0) {
      Run([&](const Progress& progress) {
        if (is_time(progress)) kill(getpid(), SIGKILL);
      });
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status)) << "ended before it was killed";
  }

  std::vector<uint8_t> Uninterrupted() {
    std::vector<uint8_t> bytes = Run();
    fs::remove_all(path_);
    fs::create_directory(path_);
    return bytes;
  }

  std::string FileOfRun(const std::string& name) const {
    return (fs::directory_iterator(path_)->path() / name).string();
  }
  void DamageFile(const std::string& name, int64_t at) const {
    std::fstream file(FileOfRun(name), std::ios::in | std::ios::out | std::ios::binary);
    ASSERT_TRUE(file.is_open()) << name;
    file.seekg(at);
    const auto byte = static_cast<char>(file.get() ^ 1);
    file.seekp(at);
    file.put(byte);
  }

  std::string path_;
  Eigen::Matrix3Xd points_;
};

std::function<bool(const Progress&)> At(Stage stage, double fraction) {
  return [=](const Progress& seen) { return seen.stage == stage && seen.fraction >= fraction; };
}

// When what is coded is measured.
std::function<bool(const Progress&)> AfterCoding() {
  return [coded = false](const Progress& seen) mutable {
    coded = coded || seen.stage == Stage::kEncode;
    return coded && seen.stage == Stage::kMeasure;
  };
}

TEST_F(ResumeTest, KilledAtAnyMomentItEndsWithTheSameBytes) {
  const std::vector<uint8_t> expected = Uninterrupted();
  // Heights are reported for the thinned points, then for each part.
  int heights = 0;
  const auto in_parts = [&](const Progress& seen) {
    heights += seen.stage == Stage::kDisplacement && seen.fraction == 0;
    return heights == 2 && seen.fraction > 0.5;
  };
  RunUntil(At(Stage::kCheck, 0.1));
  RunUntil(At(Stage::kNormals, 0.3));
  RunUntil(in_parts);
  RunUntil(At(Stage::kEncode, 0.0));
  RunUntil(AfterCoding());
  std::set<Stage> done_again;
  EXPECT_EQ(Run([&](const Progress& seen) { done_again.insert(seen.stage); }), expected);
  EXPECT_EQ(done_again, (std::set<Stage>{Stage::kDisplacement, Stage::kMeasure}));
}

TEST_F(ResumeTest, WhatIsDamagedIsDoneAgain) {
  const std::vector<uint8_t> expected = Uninterrupted();
  RunUntil(At(Stage::kEncode, 0.0));
  DamageFile("surfels", 20 * 5000 + 3);
  DamageFile("heights", 1000);
  DamageFile("fit", 100);
  RunUntil(AfterCoding());
  DamageFile("coded", 300);
  RunUntil(AfterCoding());
  DamageFile("coarse", 5000);
  for (int at = 100; at < 200; ++at) DamageFile("left-out", at);
  EXPECT_EQ(Run(), expected);
  DamageFile("pages", 5000);
  EXPECT_EQ(Run(), expected);
}

TEST_F(ResumeTest, WhatWasLeftOutIsNotLookedForAgain) {
  const std::vector<uint8_t> expected = Uninterrupted();
  RunUntil(At(Stage::kNeighbors, 0.0));
  const std::vector<uint8_t> found((12000 + 7) / 8, 0x22);
  {
    const KeptScratch scratch = KeptScratch::Open(path_, "torus").value();
    ScratchBlocks blocks =
        ScratchBlocks::Create(scratch.folder(), "left-out", 1, 64 * kPagePoints / 8).value();
    EXPECT_EQ(blocks.Read(0)->size(), found.size());
    ASSERT_TRUE(blocks.Write(0, found).ok());
  }
  EXPECT_NE(Run(), expected) << "every fourth point is left out";
}

// Checksums do not tell who wrote the bytes.
TEST_F(ResumeTest, WhatDoesNotFitIsDoneAgainWhateverItsChecksum) {
  const std::vector<uint8_t> expected = Uninterrupted();
  RunUntil(AfterCoding());
  {
    const KeptScratch scratch = KeptScratch::Open(path_, "torus").value();
    const ScratchFolder& folder = scratch.folder();
    std::vector<uint8_t> coarse = folder.Load("coarse").value();
    // It ends with level, heights and sources, the latter two behind their number.
    int64_t found = 0;
    size_t count = 0;
    do {
      ++count;
      std::memcpy(&found, &coarse[coarse.size() - count - sizeof(found)], sizeof(found));
    } while (found != static_cast<int64_t>(count));
    const int level = 7;
    std::memcpy(&coarse[coarse.size() - 5 * count - 2 * sizeof(found) - sizeof(level)], &level,
                sizeof(level));
    ASSERT_TRUE(folder.Save("coarse", coarse).ok());
  }
  std::set<Stage> done_again;
  EXPECT_EQ(Run([&](const Progress& seen) { done_again.insert(seen.stage); }), expected);
  EXPECT_EQ(done_again.count(Stage::kControlMesh), 1u);
}

}  // namespace
}  // namespace rilievo
