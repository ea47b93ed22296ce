// Small pieces gathered into blocks on their way to a stream.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <ostream>
#include <string>

namespace rilievo {

class BlockWriter {
 public:
  explicit BlockWriter(std::ostream& out) : out_(out) { block_.reserve(kBlock + 256); }
  ~BlockWriter() { Flush(); }
  BlockWriter(const BlockWriter&) = delete;
  BlockWriter& operator=(const BlockWriter&) = delete;

  // What is appended to it is written.
  std::string& text() {
    if (block_.size() > kBlock) Flush();
    return block_;
  }
  // The bytes of a value, little-endian.
  template <typename T>
  void Little(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if constexpr (std::endian::native == std::endian::big) std::reverse(raw, raw + sizeof(T));
    text().append(raw, sizeof(T));
  }

 private:
  static constexpr size_t kBlock = size_t{1} << 18;
  void Flush() {
    out_.write(block_.data(), static_cast<std::streamsize>(block_.size()));
    block_.clear();
  }
  std::ostream& out_;
  std::string block_;
};

}  // namespace rilievo
