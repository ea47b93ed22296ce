#include "server/store/blob_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <fstream>

#include "server/store/content_name.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

std::string Contents(const FileDescriptor& file) {
  std::string bytes(static_cast<size_t>(*file.Size()), '\0');
  EXPECT_TRUE(file.ReadAt(0, bytes.data(), bytes.size()).ok());
  return bytes;
}

TEST(BlobFolder, KeepsBytesUnderTheirHash) {
  const TestFolder test;
  const auto blobs = BlobFolder::Open(test / "blobs");
  ASSERT_TRUE(blobs.ok());
  const auto name = blobs->Put({{'a', 'b'}, {}, {'c'}});
  ASSERT_TRUE(name.ok()) << name.status();
  EXPECT_EQ(*name, ContentNameOf("abc"));
  EXPECT_EQ(Contents(*blobs->Read(*name)), "abc");
  EXPECT_EQ(*blobs->Put({{'a', 'b', 'c'}}), *name) << "the same bytes once more";
  EXPECT_EQ(blobs->List()->size(), 1u);
  ASSERT_TRUE(blobs->Remove(*name).ok());
  EXPECT_TRUE(absl::IsNotFound(blobs->Read(*name).status()));
}

TEST(BlobFolder, NamesThatAreNoHashesReachNoFile) {
  const TestFolder test;
  std::ofstream(test / "secret") << "x";
  const auto blobs = BlobFolder::Open(test / "blobs");
  EXPECT_TRUE(absl::IsNotFound(blobs->Read("../secret").status()));
  EXPECT_TRUE(absl::IsNotFound(blobs->Read("").status()));
}

TEST(BlobFolder, WhatWasNotFinishedIsRemoved) {
  const TestFolder test;
  const std::string whole = test / "blobs/" + ContentNameOf("x");
  std::filesystem::create_directory(test / "blobs");
  std::ofstream(test / "blobs/new-3") << "half";
  std::ofstream(whole) << "x";
  const auto blobs = BlobFolder::Open(test / "blobs");
  ASSERT_TRUE(blobs.ok());
  EXPECT_FALSE(std::filesystem::exists(test / "blobs/new-3"));
  EXPECT_TRUE(std::filesystem::exists(whole));
}

// A full disk is played by the largest size of a file.
TEST(BlobFolder, AFullDiskLeavesNothingBehind) {
  const TestFolder test;
  const auto blobs = BlobFolder::Open(test / "blobs");
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{100'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const auto refused = blobs->Put({std::vector<uint8_t>(200'000, 7)});
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted) << refused.status();
  EXPECT_TRUE(std::filesystem::is_empty(test / "blobs"));
  EXPECT_TRUE(blobs->Put({std::vector<uint8_t>(200'000, 7)}).ok());
}

}  // namespace
}  // namespace rilievo
