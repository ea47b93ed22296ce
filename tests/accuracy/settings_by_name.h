// The settings of the core's stages, to be changed by name in a build with the CMake option
// RILIEVO_ABLATION.
#pragma once

#include <string_view>
#include <vector>

namespace rilievo {

struct NamedSetting {
  std::string_view name;  // file.field: find_foliage.own_sheet
  bool whole;             // a count
  double (*value)();
  void (*set)(double);  // process-wide; while nothing else works
};

// All settings that are single numbers. Empty in a build that cannot change them.
std::vector<NamedSetting> AllSettings();

}  // namespace rilievo
