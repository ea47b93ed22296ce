// The words in which commands are told planes, rays and other numbers.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/surface/plane_section.h"

namespace rilievo {

// Scan frame.
struct ProbeRay {
  Eigen::Vector3d from, direction;  // the direction has a length, not that of a unit vector
};

// As many finite numbers with ',' between them; nothing for any other word.
std::optional<Eigen::VectorXd> ReadNumbers(absl::string_view word, int count);

// Each word is "x=D", "y=D" or "z=D", or "A,B,C,D". Normals are as told, not of unit length.
// INVALID_ARGUMENT, with the exit code kUsage, names a word of any other form or a zero normal.
absl::StatusOr<std::vector<Plane>> ReadPlaneWords(const std::vector<std::string>& words);

// Each word is six numbers with ',' between them. Errors likewise.
absl::StatusOr<std::vector<ProbeRay>> ReadRayWords(const std::vector<std::string>& words);

}  // namespace rilievo
