// SHA-256 (FIPS 180-4): the fingerprint by which a file names the scan it was made from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace rilievo {

class Sha256 {
 public:
  void Add(std::span<const uint8_t> bytes);
  // Of all bytes added; nothing may be added afterwards.
  std::array<uint8_t, 32> Finish();

 private:
  void Compress(const uint8_t* block);

  std::array<uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                    0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<uint8_t, 64> pending_{};
  size_t pending_bytes_ = 0;
  uint64_t total_bytes_ = 0;
};

}  // namespace rilievo
