#include "server/os/file_descriptor.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <utility>

namespace rilievo {
namespace {

FileDescriptor Memory() { return FileDescriptor(memfd_create("test", MFD_CLOEXEC)); }

TEST(FileDescriptor, ClosesOnceAndMoves) {
  FileDescriptor first = Memory();
  const int number = first.number();
  FileDescriptor second = std::move(first);
  EXPECT_FALSE(first.valid());
  EXPECT_EQ(second.number(), number);
  second = FileDescriptor();
  EXPECT_EQ(fcntl(number, F_GETFD), -1);
  EXPECT_EQ(errno, EBADF);
}

TEST(FileDescriptor, ReadsAndWritesAllOrSaysWhy) {
  const FileDescriptor file = Memory();
  const std::string text(100'000, 'x');
  ASSERT_TRUE(file.Write(text.data(), text.size()).ok());
  EXPECT_EQ(*file.Size(), 100'000);
  std::string back(text.size(), '\0');
  EXPECT_TRUE(file.ReadAt(0, back.data(), back.size()).ok());
  EXPECT_EQ(back, text);
  EXPECT_EQ(file.ReadAt(1, back.data(), back.size()).code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(file.Read(back.data(), 1).code(), absl::StatusCode::kOutOfRange) << "at its end";
  EXPECT_FALSE(FileDescriptor().Size().ok());
}

TEST(FileDescriptor, AFullDeviceIsExhausted) {
  const FileDescriptor full(open("/dev/full", O_WRONLY | O_CLOEXEC));
  ASSERT_TRUE(full.valid());
  EXPECT_EQ(full.Write("x", 1).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(StatusOfErrno(EMFILE, "open").code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(StatusOfErrno(EIO, "read").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(StatusOfErrno(EBADF, "read").code(), absl::StatusCode::kInternal);
}

}  // namespace
}  // namespace rilievo
