#include "server/store/folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

TEST(Folder, IsMadeOnceAndListed) {
  const TestFolder test;
  const std::string path = test / "new";
  ASSERT_TRUE(MakeFolder(path).ok());
  ASSERT_TRUE(MakeFolder(path).ok());
  std::ofstream(path + "/b") << "12345";
  std::ofstream(path + "/a") << "1";
  std::filesystem::create_directory(path + "/c");
  const auto files = ListFiles(path);
  ASSERT_TRUE(files.ok());
  ASSERT_EQ(files->size(), 2u);
  EXPECT_EQ((*files)[0].name, "a");
  EXPECT_EQ((*files)[1].bytes, 5);
  EXPECT_GT((*files)[1].modified_ms, int64_t{1'600'000'000'000});
  EXPECT_TRUE(RemoveFile(path + "/a").ok());
  EXPECT_TRUE(RemoveFile(path + "/a").ok()) << "already gone";
  EXPECT_EQ(ListFiles(path)->size(), 1u);
  EXPECT_FALSE(MakeFolder(test / "x/y").ok());
  EXPECT_TRUE(absl::IsNotFound(OpenFile(test / "nothing", O_RDONLY).status()));
}

TEST(Folder, HasOneOwner) {
  const TestFolder test;
  auto first = LockFolder(test.path());
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(LockFolder(test.path()).status().code(), absl::StatusCode::kUnavailable);
  first->Close();
  EXPECT_TRUE(LockFolder(test.path()).ok());
}

}  // namespace
}  // namespace rilievo
