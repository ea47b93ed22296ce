// The frame of a .dss file: signature, then chunks with a tag, a length and a checksum each.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

// Of a file that needs no newer one, and the newest.
inline constexpr int kDssVersion = 3, kNewestDssVersion = 6;

// A capital letter is a chunk that a decoder must understand, a small one may be skipped.
enum ChunkTag : uint8_t {
  kControlTag = 'C',
  kHeightsTag = 'H',
  kUpdateTag = 'U',
  kSmoothedTag = 's',
  kColorsTag = 'c',
};

// One chunk as it stands in the file; the first one brings the signature and the version along.
std::vector<uint8_t> WrapChunk(uint8_t tag, std::span<const uint8_t> payload, bool first,
                               int version = kDssVersion);

struct Chunk {
  size_t number = 0;  // in the file
  uint8_t tag = 0;
  std::span<const uint8_t> payload;  // of the caller's bytes
  int64_t bytes = 0;                 // with its frame
  std::span<const uint8_t> checked;  // what the checksum is of
  uint32_t checksum = 0;
};

struct ChunkList {
  int version = 0;
  std::vector<Chunk> chunks;
};

// INVALID_ARGUMENT when the bytes do not start like a .dss file, UNIMPLEMENTED for a newer version,
// DATA_LOSS that names the chunk when one is cut off or its checksum is wrong. Looks at lengths
// alone unless `check`.
absl::StatusOr<ChunkList> ListChunks(std::span<const uint8_t> bytes, bool check = true);

// DATA_LOSS that names the chunk when its checksum is wrong.
absl::Status CheckChunk(const Chunk& chunk);

}  // namespace rilievo
