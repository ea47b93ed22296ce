// Bytes that claim to be an E57 file, with whole pages, the length in the header and all checksums
// set right: what a malicious writer does, and what random changes never hit.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "core/codec/bytes/crc32c.h"

namespace rilievo {

// The bytes of a number, the low one first.
template <typename T>
std::string LowBytesFirst(T value) {
  std::string raw(reinterpret_cast<const char*>(&value), sizeof(T));
  if (std::endian::native == std::endian::big) raw.assign(raw.rbegin(), raw.rend());
  return raw;
}

inline std::string WithRightPageChecksums(std::string bytes) {
  constexpr size_t kHeader = 48, kLength = 16, kPageSize = 40;
  size_t page = 1024;
  if (bytes.size() >= kHeader) {
    uint64_t named = 0;
    for (size_t i = 8; i-- > 0;) named = named << 8 | static_cast<uint8_t>(bytes[kPageSize + i]);
    if (named >= kHeader + 4 && named <= 4096) page = static_cast<size_t>(named);
  }
  bytes.resize((bytes.size() + page - 1) / page * page);
  if (bytes.empty()) return bytes;
  bytes.replace(kLength, 8, LowBytesFirst<uint64_t>(bytes.size()));
  for (size_t at = 0; at < bytes.size(); at += page) {
    const auto* payload = reinterpret_cast<const uint8_t*>(bytes.data() + at);
    const uint32_t crc = Crc32c(std::span<const uint8_t>(payload, page - 4));
    for (size_t i = 0; i < 4; ++i) {
      bytes[at + page - 4 + i] = static_cast<char>(crc >> (24 - 8 * i));
    }
  }
  return bytes;
}

}  // namespace rilievo
