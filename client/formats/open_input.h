// Opening files (or the standard input) for the readers.
#pragma once

#include <cstdint>
#include <fstream>
#include <istream>
#include <memory>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

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

// read(std::istream&) on the file or, for "-", on the standard input; puts the path before the
// message of an error.
template <typename Read>
auto WithInput(const std::string& path, Read read)
    -> decltype(read(std::declval<std::istream&>())) {
  const auto named = [&](const absl::Status& status) {
    absl::Status with_path(status.code(), absl::StrCat(path, ": ", status.message()));
    status.ForEachPayload([&](absl::string_view url, const absl::Cord& payload) {
      with_path.SetPayload(url, payload);
    });
    return with_path;
  };
  if (path == "-") {
    const std::unique_ptr<std::istream> standard_input = OpenStandardInput();
    auto result = read(*standard_input);
    if (!result.ok()) return named(result.status());
    return result;
  }
  absl::StatusOr<std::ifstream> file = OpenFile(path);
  if (!file.ok()) return file.status();
  auto result = read(*file);
  if (!result.ok()) return named(result.status());
  return result;
}

}  // namespace rilievo
