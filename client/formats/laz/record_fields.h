// Fields of a LAS record, which are little-endian.
#pragma once

#include <bit>

#include "client/formats/scalar_type.h"

namespace rilievo::laz {

inline constexpr bool kSwap = std::endian::native == std::endian::big;

template <typename T>
T Load(const char* bytes) {
  return LoadAs<T>(bytes, kSwap);
}

template <typename T>
void Store(T value, char* bytes) {
  std::memcpy(bytes, &value, sizeof(T));
  if (kSwap) std::reverse(bytes, bytes + sizeof(T));
}

}  // namespace rilievo::laz
