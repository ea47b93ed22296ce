// Where a parameter of a surface lies in a table of patches.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rilievo {

struct PatchPlace {
  int face = 0;         // the control face
  int32_t code = 0;     // of the part there
  double u = 0, v = 0;  // of the part
  double scale = 1;     // how many times faster they grow than those of the control face
};

// Asks the memory for all of a part at once: at random parameters waiting for it is what takes
// time. It is not to stay in the larger caches, where the table's nodes are wanted by all.
template <typename Part>
void PrefetchPart(const Part& part) {
  for (size_t line = 0; line < sizeof(part); line += 64) {
    __builtin_prefetch(reinterpret_cast<const char*>(&part) + line, 0, 0);
  }
}

}  // namespace rilievo
