// An open file, pipe or socket that closes itself, and whole reads and writes of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

// RESOURCE_EXHAUSTED where room, memory, quota or file handles are lacking; else INTERNAL. Message:
// "<what>: <the system's words>".
absl::Status StatusOfErrno(int error, std::string_view what);

class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(other.Release()) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  ~FileDescriptor() { Close(); }

  bool valid() const { return number_ >= 0; }
  int number() const { return number_; }

  // Gives up ownership.
  int Release();
  void Close();

  // All of it at the file's own offset, interrupted or not.
  absl::Status Write(const void* data, size_t size) const;

  // The same to a socket; one whose peer is gone raises no signal.
  absl::Status Send(const void* data, size_t size) const;

  // Exactly `size` bytes. OUT_OF_RANGE when the file or stream ends before.
  absl::Status Read(void* data, size_t size) const;
  absl::Status ReadAt(int64_t offset, void* data, size_t size) const;

  // Of a file.
  absl::StatusOr<int64_t> Size() const;

 private:
  int number_ = -1;
};

}  // namespace rilievo
