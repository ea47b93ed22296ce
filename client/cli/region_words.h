// The words in which `rilievo export --region` names control faces.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace rilievo {

struct RegionWords {
  std::vector<std::pair<int, int>> faces;  // first to last, both included
  std::vector<Eigen::AlignedBox3d> boxes;  // scan frame
};

// Each word is a number, two with '-' between them (control faces), or "box:" and six numbers with
// ',' between them: two opposite corners, x, y, z. INVALID_ARGUMENT that names another word.
absl::StatusOr<RegionWords> ReadRegionWords(const std::vector<std::string>& words);

}  // namespace rilievo
