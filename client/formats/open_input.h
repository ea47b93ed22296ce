// Opening files (or the standard input) for the readers.
#pragma once

#include <cstdint>
#include <fstream>
#include <istream>
#include <memory>
#include <streambuf>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace rilievo {

// A stream whose first bytes have been looked at, readable from its start, seekable or not.
class HeadedInput {
 public:
  // `in` must outlive this.
  explicit HeadedInput(std::istream& in);

  std::string_view head() const { return head_; }
  uint64_t size() const { return size_; }  // 0 if unknown
  std::istream& stream() { return *stream_; }

 private:
  std::string head_;
  uint64_t size_ = 0;
  std::unique_ptr<std::streambuf> rejoined_;
  std::unique_ptr<std::istream> rejoined_stream_;
  std::istream* stream_;
};

// The stream of `path`, opened for reading: NOT_FOUND, PERMISSION_DENIED, or INVALID_ARGUMENT for a
// directory.
absl::StatusOr<std::ifstream> OpenFile(const std::string& path);

// Seekable when the standard input is a file.
std::unique_ptr<std::istream> OpenStandardInput();

}  // namespace rilievo
