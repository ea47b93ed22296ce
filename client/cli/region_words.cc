#include "client/cli/region_words.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/codec/container/decode_region.h"

namespace rilievo {
namespace {

constexpr absl::string_view kBox = "box:";

bool ReadBox(absl::string_view word, RegionWords& region) {
  const std::vector<std::string> parts = absl::StrSplit(word, ',');
  if (parts.size() != 6) return false;
  Eigen::Vector3d ends[2];
  for (int i = 0; i < 6; ++i) {
    if (!absl::SimpleAtod(parts[i], &ends[i / 3][i % 3]) || !std::isfinite(ends[i / 3][i % 3])) {
      return false;
    }
  }
  region.boxes.emplace_back(ends[0].cwiseMin(ends[1]), ends[0].cwiseMax(ends[1]));
  return true;
}

bool ReadFaces(absl::string_view word, RegionWords& region) {
  const std::vector<std::string> ends = absl::StrSplit(word, absl::MaxSplits('-', 1));
  int first = 0, last = 0;
  if (!absl::SimpleAtoi(ends.front(), &first) || !absl::SimpleAtoi(ends.back(), &last) ||
      first < 0 || last < first) {
    return false;
  }
  region.faces.emplace_back(first, last);
  return true;
}

}  // namespace

absl::StatusOr<RegionWords> ReadRegionWords(const std::vector<std::string>& words) {
  RegionWords region;
  for (const std::string& word : words) {
    const bool read = absl::StartsWith(word, kBox)
                          ? ReadBox(absl::string_view(word).substr(kBox.size()), region)
                          : ReadFaces(word, region);
    if (read) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("--region ", word,
                     ": must be a control face (17), some in a row (0-99), or a box in the "
                     "scan's coordinates (box:X,Y,Z,X,Y,Z)"));
  }
  return region;
}

absl::StatusOr<std::vector<int>> FacesNamed(const RegionWords& words,
                                            const DecodedSurface& control) {
  const ControlMesh& mesh = control.surface.control_mesh;
  std::set<int> faces;
  for (const auto& [first, last] : words.faces) {
    if (last >= mesh.faces.cols()) {
      return absl::InvalidArgumentError(
          absl::StrCat("--region ", last, ": control faces are 0 to ", mesh.faces.cols() - 1));
    }
    for (int f = first; f <= last; ++f) faces.insert(f);
  }
  for (const Eigen::AlignedBox3d& box : words.boxes) {
    const std::vector<int> inside = ControlFacesInBox(control.surface.frame, mesh, box);
    faces.insert(inside.begin(), inside.end());
  }
  if (faces.empty()) {
    return absl::InvalidArgumentError("--region: there are no control faces in the box");
  }
  return std::vector<int>(faces.begin(), faces.end());
}

}  // namespace rilievo
