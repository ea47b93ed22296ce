// Patches as a STEP file: what librilievo_step.so has for the command `rilievo`.
#pragma once

#include <string>

#include "core/bicubic/bicubic_shell.h"

namespace rilievo {

struct StepFile {
  std::string path;      // written over
  std::string name;      // of the product
  std::string program;   // that writes it, with its version
  double tolerance = 0;  // of edges and vertices, in millimetres
};

// AP214; coordinates in millimetres, as they stand. Patches that share edges make a shell. A closed
// shell is a solid; one inside of a solid that is turned inwards is a void of it, elsewhere a shell
// alone. Edges and vertices are shared, nothing is sewn. The same patches give the same bytes.
// `problem`: what went wrong, or "".
using WriteStepFunction = void(const BicubicShell& shell, const StepFile& file,
                               std::string* problem);

inline constexpr char kStepLibrary[] = "librilievo_step.so";
inline constexpr char kWriteStepSymbol[] = "RilievoWriteStep";
// A text, the version that the library is of.
inline constexpr char kStepVersionSymbol[] = "RilievoStepVersion";

}  // namespace rilievo
