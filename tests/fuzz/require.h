// What must hold for every input.
#pragma once

#include <cstdlib>

namespace rilievo {

inline void Require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace rilievo
