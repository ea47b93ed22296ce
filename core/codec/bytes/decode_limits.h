// How much a decoder may be made to produce by how many bytes.
#pragma once

#include <algorithm>
#include <cstdint>

namespace rilievo {

// A chunk of n bytes of payload holds at most so many items per byte. Coded data may need less than
// that, a flat surface next to nothing: an encoder pads such a chunk with zeros up to the law, so
// every decoder can refuse the rest before it allocates anything.
inline constexpr int64_t kControlVerticesPerByte = 16;
inline constexpr int64_t kControlFacesPerByte = 32;
inline constexpr int64_t kHeightsPerByte = 256;

// From version 2 on, this many heights of a file are free, so that small files need no padding: a
// decoder has to have some 32 MB anyway. Version 1 held every layer to its own bytes.
inline constexpr int64_t kFreeHeights = 1 << 18;

// Bytes of payload that so many items must have.
inline constexpr int64_t BytesByLimit(int64_t items, int64_t items_per_byte) {
  return (items + items_per_byte - 1) / items_per_byte;
}

// Bytes that the payloads of all height layers up to one must have together, when the surface has
// so many vertices at its level.
inline constexpr int64_t HeightBytesByLimit(int64_t vertices) {
  return BytesByLimit(std::max<int64_t>(0, vertices - kFreeHeights), kHeightsPerByte);
}

}  // namespace rilievo
