// Numbers of binary files, in either byte order.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

namespace rilievo {

enum class ScalarType : uint8_t { kI8, kU8, kI16, kU16, kI32, kU32, kI64, kU64, kF32, kF64 };

inline size_t ScalarSize(ScalarType type) {
  constexpr size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<size_t>(type)];
}

inline bool IsInteger(ScalarType type) { return type < ScalarType::kF32; }

// Whether numbers of little-endian files must be byte-reversed on this machine.
inline constexpr bool kSwapLittle = std::endian::native == std::endian::big;

template <typename T>
T LoadAs(const char* bytes, bool swap) {
  char raw[sizeof(T)];
  std::memcpy(raw, bytes, sizeof(T));
  if (swap) std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

// The scalar at `bytes` (any alignment), byte-reversed first if `swap`, as double.
inline double LoadScalar(const char* bytes, ScalarType type, bool swap) {
  switch (type) {
    case ScalarType::kI8:
      return LoadAs<int8_t>(bytes, false);
    case ScalarType::kU8:
      return LoadAs<uint8_t>(bytes, false);
    case ScalarType::kI16:
      return LoadAs<int16_t>(bytes, swap);
    case ScalarType::kU16:
      return LoadAs<uint16_t>(bytes, swap);
    case ScalarType::kI32:
      return LoadAs<int32_t>(bytes, swap);
    case ScalarType::kU32:
      return LoadAs<uint32_t>(bytes, swap);
    case ScalarType::kI64:
      return static_cast<double>(LoadAs<int64_t>(bytes, swap));
    case ScalarType::kU64:
      return static_cast<double>(LoadAs<uint64_t>(bytes, swap));
    case ScalarType::kF32:
      return LoadAs<float>(bytes, swap);
    case ScalarType::kF64:
      return LoadAs<double>(bytes, swap);
  }
  return 0;
}

}  // namespace rilievo
