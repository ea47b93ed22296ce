#include "core/codec/bytes/stored_step.h"

#include <bit>
#include <cstdint>

namespace rilievo {

double StoredStep(double step) {
  constexpr int kDropped = 52 - 12;
  const uint64_t bits = std::bit_cast<uint64_t>(step) + (uint64_t{1} << (kDropped - 1));
  return std::bit_cast<double>(bits >> kDropped << kDropped);
}

}  // namespace rilievo
