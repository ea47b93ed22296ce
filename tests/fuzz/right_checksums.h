// Bytes that claim to be a .dss, with the signature and all checksums set right: what a malicious
// writer does, and what random changes never hit.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {

inline constexpr uint8_t kDssSignature[] = {0x89, 0x44, 0x53, 0x53, 0x0d, 0x0a, 0x1a, 0x0a};

inline void PutChecksum(size_t begin, size_t end, std::vector<uint8_t>& bytes) {
  if (end < begin || end + 4 > bytes.size()) return;
  const uint32_t crc = Crc32c(std::span<const uint8_t>(bytes).subspan(begin, end - begin));
  for (int i = 0; i < 4; ++i) bytes[end + i] = static_cast<uint8_t>(crc >> 8 * i);
}

// Those within a chunk of groups, whose number is not known here: the index is tried with each
// number that could be meant, the last one wins that ends at the chunk's end. `has_step`: what
// stands before the index in a chunk of heights, not in one of flags.
inline void SetGroupChecksums(size_t begin, size_t end, bool has_step,
                              std::vector<uint8_t>& bytes) {
  constexpr int kMostGroups = 9;
  for (int groups = 1; groups <= kMostGroups; ++groups) {
    ByteReader reader(std::span<const uint8_t>(bytes).subspan(begin, end - begin));
    if (has_step) {
      reader.Byte();
      reader.Varint();
    }
    size_t sizes[kMostGroups], all = 0;
    for (int g = 0; g < groups; ++g) {
      sizes[g] = reader.Varint();
      all += sizes[g] > 0 ? sizes[g] + 4 : 0;
    }
    if (!reader.ok() || reader.remaining() != all + 4) continue;
    size_t at = begin + reader.position();
    PutChecksum(begin, at, bytes);
    at += 4;
    for (int g = 0; g < groups; ++g) {
      if (sizes[g] == 0) continue;
      PutChecksum(at, at + sizes[g], bytes);
      at += sizes[g] + 4;
    }
  }
}

// Those of the three channels of a chunk of colours, each like a chunk of heights.
inline void SetColorChecksums(size_t begin, size_t end, std::vector<uint8_t>& bytes) {
  for (int channel = 0; channel < 3; ++channel) {
    ByteReader reader(std::span<const uint8_t>(bytes).subspan(begin, end - begin));
    const size_t size = reader.Bytes(reader.Varint()).size();
    if (!reader.ok()) return;
    begin += reader.position();
    SetGroupChecksums(begin - size, begin, true, bytes);
  }
}

inline std::vector<uint8_t> WithRightChecksums(std::span<const uint8_t> bytes) {
  std::vector<uint8_t> right(bytes.begin(), bytes.end());
  if (right.size() < sizeof(kDssSignature) + 1) return right;
  std::copy(std::begin(kDssSignature), std::end(kDssSignature), right.begin());
  size_t begin = 0, at = sizeof(kDssSignature) + 1;
  while (at < right.size()) {
    ByteReader reader(std::span<const uint8_t>(right).subspan(at));
    const uint8_t tag = reader.Byte();
    const size_t size = reader.Bytes(reader.Varint()).size();
    if (!reader.ok() || reader.remaining() < 4) break;
    const size_t end = at + reader.position();
    if (tag == 'c') SetColorChecksums(end - size, end, right);
    if (tag == 'H' || tag == 's') SetGroupChecksums(end - size, end, tag == 'H', right);
    PutChecksum(begin, end, right);
    begin = at = end + 4;
  }
  return right;
}

}  // namespace rilievo
