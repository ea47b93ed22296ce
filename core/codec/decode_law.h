// How much a decoder may be made to produce by how many bytes.
#pragma once

#include <cstdint>

namespace rilievo {

// A chunk of n bytes of payload holds at most so many items per byte. Coded data may need less than
// that, a flat surface next to nothing: an encoder pads such a chunk with zeros up to the law, so
// every decoder can refuse the rest before it allocates anything.
inline constexpr int64_t kControlVerticesPerByte = 16;
inline constexpr int64_t kControlFacesPerByte = 32;
inline constexpr int64_t kHeightsPerByte = 256;

// Bytes of payload that so many items must have.
inline constexpr int64_t BytesByLaw(int64_t items, int64_t items_per_byte) {
  return (items + items_per_byte - 1) / items_per_byte;
}

}  // namespace rilievo
