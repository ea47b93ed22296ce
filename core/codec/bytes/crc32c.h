// The checksum of a .dss chunk.
#pragma once

#include <cstdint>
#include <span>

namespace rilievo {

// CRC-32C (Castagnoli; polynomial 0x1EDC6F41, reflected, initial value and final xor 0xFFFFFFFF),
// as in RFC 3720 B.4. `previous`: the CRC of the bytes before these, to go on from; 0 at the start.
uint32_t Crc32c(std::span<const uint8_t> bytes, uint32_t previous = 0);

}  // namespace rilievo
