// Fields of a LAS record, which are little-endian.
#pragma once

#include "client/formats/scalar_type.h"

namespace rilievo::laz {

template <typename T>
T Load(const char* bytes) {
  return LoadAs<T>(bytes, kSwapLittle);
}

template <typename T>
void Store(T value, char* bytes) {
  std::memcpy(bytes, &value, sizeof(T));
  if (kSwapLittle) std::reverse(bytes, bytes + sizeof(T));
}

}  // namespace rilievo::laz
