#include "client/formats/open_input.h"

#include <absl/strings/str_cat.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "client/formats/file_kind.h"

namespace rilievo {
namespace {

// Some bytes, then the rest of another buffer.
class Rejoined : public std::streambuf {
 public:
  Rejoined(std::string_view head, std::streambuf* rest) : rest_(rest) {
    block_.assign(head);
    setg(block_.data(), block_.data(), block_.data() + block_.size());
  }

 protected:
  int_type underflow() override {
    block_.resize(1 << 16);
    const std::streamsize count =
        rest_->sgetn(block_.data(), static_cast<std::streamsize>(block_.size()));
    setg(block_.data(), block_.data(), block_.data() + count);
    return count > 0 ? traits_type::to_int_type(block_.front()) : traits_type::eof();
  }

 private:
  std::string block_;
  std::streambuf* rest_;
};

// The bytes of descriptor 0 as it was handed over: to open /dev/stdin would wait for another writer
// where it is a named pipe.
class DescriptorBytes : public std::streambuf {
 protected:
  int_type underflow() override {
    block_.resize(1 << 16);
    ssize_t count;
    do {
      count = ::read(STDIN_FILENO, block_.data(), block_.size());
    } while (count < 0 && errno == EINTR);
    setg(block_.data(), block_.data(), block_.data() + std::max<ssize_t>(count, 0));
    return count > 0 ? traits_type::to_int_type(block_.front()) : traits_type::eof();
  }

 private:
  std::string block_;
};

class DescriptorInput : public std::istream {
 public:
  DescriptorInput() : std::istream(nullptr) { rdbuf(&bytes_); }

 private:
  DescriptorBytes bytes_;
};

}  // namespace

std::unique_ptr<std::istream> OpenStandardInput() {
  struct stat status {};
  if (fstat(STDIN_FILENO, &status) == 0 && S_ISREG(status.st_mode)) {
    return std::make_unique<std::ifstream>("/dev/stdin", std::ios::binary);
  }
  return std::make_unique<DescriptorInput>();
}

HeadedInput::HeadedInput(std::istream& in) : stream_(&in) {
  const std::istream::pos_type start = in.tellg();
  head_.resize(kHeadBytes);
  in.read(head_.data(), static_cast<std::streamsize>(head_.size()));
  head_.resize(static_cast<size_t>(in.gcount()));
  in.clear();
  if (start != std::istream::pos_type(-1)) {
    in.seekg(0, std::ios::end);
    size_ = static_cast<uint64_t>(in.tellg() - start);
    in.clear();
    in.seekg(start);
    return;
  }
  rejoined_ = std::make_unique<Rejoined>(head_, in.rdbuf());
  rejoined_stream_ = std::make_unique<std::istream>(rejoined_.get());
  stream_ = rejoined_stream_.get();
}

absl::StatusOr<std::ifstream> OpenFile(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": a folder; give a file"));
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (file) return file;
  const int reason = errno;
  const std::string message = absl::StrCat(path, ": cannot be read: ", std::strerror(reason));
  if (reason == ENOENT) return absl::NotFoundError(message);
  if (reason == EACCES) return absl::PermissionDeniedError(message);
  return absl::FailedPreconditionError(message);
}

}  // namespace rilievo
