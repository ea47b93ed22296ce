// The words in which `rilievo export --region` names control faces.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/codec/container/dss.h"

namespace rilievo {

struct RegionWords {
  std::vector<std::pair<int, int>> faces;  // first to last, both included
  std::vector<Eigen::AlignedBox3d> boxes;  // scan frame
};

// Each word is a number, two with '-' between them (control faces), or "box:" and six numbers with
// ',' between them: two opposite corners, x, y, z. INVALID_ARGUMENT that names another word.
absl::StatusOr<RegionWords> ReadRegionWords(const std::vector<std::string>& words);

// The control faces that the words name, of this surface, ascending. INVALID_ARGUMENT for numbers
// beyond the last one, and when there are none.
absl::StatusOr<std::vector<int>> FacesNamed(const RegionWords& words,
                                            const DecodedSurface& control);

}  // namespace rilievo
