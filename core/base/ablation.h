// Mechanisms that a developer's build can leave out, to measure what each of them earns.
#pragma once

#ifdef RILIEVO_ABLATION
#include <bitset>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>
#endif
#include <array>
#include <string_view>

namespace rilievo {

// One for each that could be missing. What earns less than 1 % on every row of docs/accuracy.md is
// to be deleted, with its enumerator.
enum class Mechanism {
  kOutlierClouds,
  kOutliers,
  kFoliage,
  kSeparateSheets,
  kAdaptivePatches,
  kRobustNormal,
  kQuietestPatch,
  kSharpenNormals,
  kThickNoise,
  kContestedGroups,
  kInvertedPatches,
  kAmbiguousNormals,
  kBorderCells,
  kSmoothCells,
  kThinCells,
  kTellingPoints,
  kInconsistentNormals,
  kCoherence,
  kFeaturePlanes,
  kCreases,
  kUncoveredPoints,
  kHandles,
  kTrimUnmeasured,
  kStiffness,
  kDriftGuard,
  kFoldGuard,
  kSharpFootPoints,
  kReachPoints,
  kFewerFaces,
};

struct NamedMechanism {
  Mechanism mechanism;
  std::string_view name;
};

inline constexpr auto kMechanisms = std::to_array<NamedMechanism>({
    {Mechanism::kOutlierClouds, "outlier_clouds"},
    {Mechanism::kOutliers, "outliers"},
    {Mechanism::kFoliage, "foliage"},
    {Mechanism::kSeparateSheets, "separate_sheets"},
    {Mechanism::kAdaptivePatches, "adaptive_patches"},
    {Mechanism::kRobustNormal, "robust_normal"},
    {Mechanism::kQuietestPatch, "quietest_patch"},
    {Mechanism::kSharpenNormals, "sharpen_normals"},
    {Mechanism::kThickNoise, "thick_noise"},
    {Mechanism::kContestedGroups, "contested_groups"},
    {Mechanism::kInvertedPatches, "inverted_patches"},
    {Mechanism::kAmbiguousNormals, "ambiguous_normals"},
    {Mechanism::kBorderCells, "border_cells"},
    {Mechanism::kSmoothCells, "smooth_cells"},
    {Mechanism::kThinCells, "thin_cells"},
    {Mechanism::kTellingPoints, "telling_points"},
    {Mechanism::kInconsistentNormals, "inconsistent_normals"},
    {Mechanism::kCoherence, "coherence"},
    {Mechanism::kFeaturePlanes, "feature_planes"},
    {Mechanism::kCreases, "creases"},
    {Mechanism::kUncoveredPoints, "uncovered_points"},
    {Mechanism::kHandles, "handles"},
    {Mechanism::kTrimUnmeasured, "trim_unmeasured"},
    {Mechanism::kStiffness, "stiffness"},
    {Mechanism::kDriftGuard, "drift_guard"},
    {Mechanism::kFoldGuard, "fold_guard"},
    {Mechanism::kSharpFootPoints, "sharp_foot_points"},
    {Mechanism::kReachPoints, "reach_points"},
    {Mechanism::kFewerFaces, "fewer_faces"},
});

// Only a build with the CMake option RILIEVO_ABLATION can leave anything out (./dev accuracy
// --ablation); in all others the question is settled when they are compiled.
#ifdef RILIEVO_ABLATION
// The names in the environment variable RILIEVO_WITHOUT, separated by commas: for every program of
// such a build. Ends the process at a name that no mechanism has.
inline std::bitset<kMechanisms.size()> LeftOutByEnvironment() {
  std::bitset<kMechanisms.size()> left_out;
  const char* value = std::getenv("RILIEVO_WITHOUT");
  std::istringstream names(value == nullptr ? "" : value);
  for (std::string name; std::getline(names, name, ',');) {
    size_t place = 0;
    while (place < kMechanisms.size() && kMechanisms[place].name != name) ++place;
    if (place == kMechanisms.size()) {
      std::cerr << "RILIEVO_WITHOUT: no mechanism is called '" << name << "'\n";
      std::exit(EXIT_FAILURE);
    }
    left_out.set(static_cast<size_t>(kMechanisms[place].mechanism));
  }
  return left_out;
}
inline std::bitset<kMechanisms.size()> left_out_mechanisms = LeftOutByEnvironment();
// Process-wide; while nothing else works.
inline void LeaveOut(Mechanism mechanism, bool out = true) {
  left_out_mechanisms.set(static_cast<size_t>(mechanism), out);
}
inline bool IsLeftOut(Mechanism mechanism) {
  return left_out_mechanisms.test(static_cast<size_t>(mechanism));
}
// Before the definition of a stage's settings (settings.h of each room and wing), which such a
// build can change (rilievo_accuracy --set).
#define RILIEVO_SETTINGS inline
#else
#define RILIEVO_SETTINGS inline constexpr
constexpr bool IsLeftOut(Mechanism /*mechanism*/) { return false; }
#endif

}  // namespace rilievo
