#include "server/store/temporary_folder.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <vector>

#include "server/store/folder.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

class TemporaryFolderTest : public testing::Test {
 protected:
  void SetUp() override { setenv("TMPDIR", (test_ / "").c_str(), 1); }
  void TearDown() override { unsetenv("TMPDIR"); }

  int Entries() const {
    return static_cast<int>(
        std::distance(fs::directory_iterator(test_ / ""), fs::directory_iterator()));
  }

  TestFolder test_;
};

TEST_F(TemporaryFolderTest, EndsWithAllItHolds) {
  {
    const auto folder = TemporaryFolder::Make();
    ASSERT_TRUE(folder.ok()) << folder.status();
    ASSERT_TRUE(MakeFolder((*folder)->path()).ok());
    std::ofstream((*folder)->path() + "/file") << "x";
    EXPECT_EQ(Entries(), 1);
  }
  EXPECT_EQ(Entries(), 0);
}

TEST_F(TemporaryFolderTest, RemovesWhatKilledServersLeftAndNothingElse) {
  fs::create_directory(test_ / "rilievod-ephemeral-killed");
  std::ofstream(test_ / "rilievod-ephemeral-killed/lock");
  fs::create_directory(test_ / "rilievod-ephemeral-just-made");  // not locked yet
  fs::create_directory(test_ / "other");
  std::ofstream(test_ / "other/lock");
  const auto running = TemporaryFolder::Make();
  ASSERT_TRUE(running.ok());
  EXPECT_FALSE(fs::exists(test_ / "rilievod-ephemeral-killed"));
  const auto second = TemporaryFolder::Make();
  EXPECT_EQ(Entries(), 4) << "the other server's is locked";
}

TEST_F(TemporaryFolderTest, ServersThatStartAtOnceLeaveEachOtherAlone) {
  for (int round = 0; round < 20; ++round) {
    std::vector<std::future<absl::StatusOr<std::unique_ptr<TemporaryFolder>>>> starting;
    for (int i = 0; i < 8; ++i) {
      starting.push_back(std::async(std::launch::async, TemporaryFolder::Make));
    }
    std::vector<std::unique_ptr<TemporaryFolder>> running;
    for (auto& one : starting) {
      auto folder = one.get();
      ASSERT_TRUE(folder.ok()) << folder.status();
      running.push_back(*std::move(folder));
    }
    EXPECT_EQ(Entries(), 8);
  }
}

TEST_F(TemporaryFolderTest, WhereNothingCanBeWrittenIsTold) {
  setenv("TMPDIR", (test_ / "nowhere").c_str(), 1);
  EXPECT_TRUE(absl::IsUnavailable(TemporaryFolder::Make().status()));
}

}  // namespace
}  // namespace rilievo
