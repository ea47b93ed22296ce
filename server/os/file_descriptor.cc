#include "server/os/file_descriptor.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// Calls `transfer(done)`, which returns what read() and its like do, until `size` bytes are moved.
template <typename Transfer>
absl::Status TransferAll(size_t size, const char* what, const Transfer& transfer) {
  for (size_t done = 0; done < size;) {
    const ssize_t moved = transfer(done);
    if (moved > 0) {
      done += static_cast<size_t>(moved);
    } else if (moved == 0) {
      return absl::OutOfRangeError(absl::StrCat(what, ": ended after ", done, " of ", size));
    } else if (errno != EINTR) {
      return StatusOfErrno(errno, what);
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status StatusOfErrno(int error, std::string_view what) {
  const std::string message = absl::StrCat(absl::string_view(what.data(), what.size()), ": ",
                                           std::generic_category().message(error));
  switch (error) {
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
    case ENOMEM:
    case EMFILE:
    case ENFILE:
    case EAGAIN:
      return absl::ResourceExhaustedError(message);
    case EIO:  // of a disk that may be there again: no reason to give up what was made
      return absl::UnavailableError(message);
    default:
      return absl::InternalError(message);
  }
}

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  if (this != &other) {
    Close();
    number_ = other.Release();
  }
  return *this;
}

int FileDescriptor::Release() { return std::exchange(number_, -1); }

void FileDescriptor::Close() {
  if (valid()) close(Release());
}

absl::Status FileDescriptor::Write(const void* data, size_t size) const {
  return TransferAll(size, "write", [&](size_t done) {
    return ::write(number_, static_cast<const char*>(data) + done, size - done);
  });
}

absl::Status FileDescriptor::Send(const void* data, size_t size) const {
  return TransferAll(size, "send", [&](size_t done) {
    return ::send(number_, static_cast<const char*>(data) + done, size - done, MSG_NOSIGNAL);
  });
}

absl::Status FileDescriptor::Read(void* data, size_t size) const {
  return TransferAll(size, "read", [&](size_t done) {
    return ::read(number_, static_cast<char*>(data) + done, size - done);
  });
}

absl::Status FileDescriptor::ReadAt(int64_t offset, void* data, size_t size) const {
  return TransferAll(size, "read", [&](size_t done) {
    return ::pread(number_, static_cast<char*>(data) + done, size - done,
                   offset + static_cast<int64_t>(done));
  });
}

absl::StatusOr<int64_t> FileDescriptor::Size() const {
  // Not by fstat(): the C library makes it a call that could name other files, which a worker may
  // not call.
  struct stat status {};
  if (syscall(SYS_fstat, number_, &status) != 0) return StatusOfErrno(errno, "size of a file");
  return static_cast<int64_t>(status.st_size);
}

}  // namespace rilievo
