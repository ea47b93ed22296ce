// The lines of a Wavefront OBJ file that hold geometry.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <string_view>

#include "absl/status/status.h"
#include "client/formats/byte_source.h"

namespace rilievo {

struct ObjVisitor {
  // `words`: those behind the position.
  std::function<absl::Status(const Eigen::Vector3d& position, std::string_view words)> vertex;
  // The words after 'f'; empty function: faces are passed over.
  std::function<absl::Status(std::string_view words)> face;
  // The words after 't' (OpenSubdiv's tags of creases and corners); likewise.
  std::function<absl::Status(std::string_view words)> tag;
};

// Calls the visitor for each 'v', 'f' and 't' line; joins lines that end in a backslash; passes
// over all other keywords. INVALID_ARGUMENT names the line.
absl::Status VisitObjLines(ByteSource* source, const ObjVisitor& visitor);

// Red, green and blue behind a position: three numbers, up to a comment. A weight alone is not a
// colour.
std::optional<std::array<double, 3>> ParseObjColor(std::string_view words);

}  // namespace rilievo
