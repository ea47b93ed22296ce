#include "client/formats/ply_vertex.h"

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace rilievo {

absl::StatusOr<PlyVertexLayout> FindPlyVertex(const PlyHeader& header) {
  PlyVertexLayout layout;
  int found = 0;
  std::vector<std::string> names;
  for (size_t i = 0; i < header.elements.size(); ++i) {
    names.push_back(header.elements[i].name);
    if (names.back() != "vertex") continue;
    layout.element_index = i;
    ++found;
  }
  if (found == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "PLY header: no element 'vertex'; the elements are: ", absl::StrJoin(names, ", ")));
  }
  if (found > 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("PLY header: ", found,
                     " elements are called 'vertex'; keep one, the others would be lost"));
  }
  const PlyElement& element = header.elements[layout.element_index];
  if (element.count == 0) {
    return absl::InvalidArgumentError("PLY element 'vertex': the count is 0, no points");
  }
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    const int property = element.Find(kAxes[axis]);
    if (property == -1) {
      return absl::InvalidArgumentError(
          absl::StrCat("PLY element 'vertex': no property '", kAxes[axis], "'"));
    }
    if (property == -2 || element.properties[static_cast<size_t>(property)].is_list) {
      return absl::InvalidArgumentError(
          absl::StrCat("PLY element 'vertex': the property '", kAxes[axis],
                       "' must be one scalar, not several or a list"));
    }
    layout.position[static_cast<size_t>(axis)] = property;
  }
  return layout;
}

}  // namespace rilievo
