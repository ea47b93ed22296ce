#include "server/conversion/convert_control_mesh.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/conversion/option_reader.h"
#include "server/conversion/scan_size.h"

namespace rilievo {
namespace {

constexpr int64_t kControlVertexBytes = 3 * sizeof(double);

// Sharp edges and corners, ascending, each once; false when there was something to violate. Whether
// creases are edges is found out by the control stage.
bool ReadTags(const v1::ControlMesh& from, OptionReader* reader, ControlMesh* mesh) {
  const auto count = static_cast<uint64_t>(mesh->vertices.cols());
  const auto names_others = [&](const char* field, const auto& numbers) {
    for (const uint32_t number : numbers) {
      if (number < count) continue;
      reader->Violate(field, absl::StrCat("names vertex ", number, " of ", count));
      return true;
    }
    return false;
  };
  if (from.creases_size() % 2 != 0) {
    reader->Violate("creases",
                    absl::StrCat(from.creases_size(), " vertex numbers; a crease takes two"));
    return false;
  }
  if (from.sharpness_size() != 0 && 2 * from.sharpness_size() != from.creases_size()) {
    reader->Violate("sharpness", absl::StrCat(from.sharpness_size(), " numbers for ",
                                              from.creases_size() / 2, " creases"));
    return false;
  }
  if (names_others("creases", from.creases()) || names_others("corners", from.corners())) {
    return false;
  }
  std::map<std::pair<int, int>, float> creases;
  for (int i = 0; i < from.creases_size(); i += 2) {
    const auto [low, high] =
        std::minmax({static_cast<int>(from.creases(i)), static_cast<int>(from.creases(i + 1))});
    const float sharpness = from.sharpness_size() == 0 ? kInfiniteSharpness : from.sharpness(i / 2);
    if (!(sharpness > 0)) {
      reader->Violate("sharpness", absl::StrCat(sharpness, " of crease ", i / 2,
                                                "; must be above 0: leave smooth edges out"));
      return false;
    }
    creases.emplace(std::pair(low, high), sharpness);
  }
  for (const auto& [ends, sharpness] : creases) {
    mesh->creases.push_back({ends.first, ends.second, sharpness});
  }
  const std::set<int> corners(from.corners().begin(), from.corners().end());
  mesh->corners.assign(corners.begin(), corners.end());
  return true;
}

}  // namespace

void ReadControlMesh(const v1::ControlMesh& from, ControlOptions* control,
                     std::vector<FieldViolation>* violations) {
  OptionReader reader("header.options.control.control_mesh", violations);
  const size_t before = violations->size();
  if (from.positions().empty() || from.positions().size() % kControlVertexBytes != 0) {
    reader.Violate("positions", absl::StrCat(from.positions().size(),
                                             " bytes; whole vertices take 24 bytes each"));
  }
  if (from.faces_size() == 0 || from.faces_size() % 3 != 0) {
    reader.Violate("faces", absl::StrCat(from.faces_size(), " vertex numbers; a face takes three"));
  } else if (from.faces_size() / 3 > kMaxControlFaces) {
    reader.Violate("faces", absl::StrCat(from.faces_size() / 3, " faces; at most ",
                                         kMaxControlFaces, " are taken, simplify the mesh"));
  }
  if (violations->size() > before) return;
  ControlMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(from.positions().size() / kControlVertexBytes));
  std::memcpy(mesh.vertices.data(), from.positions().data(), from.positions().size());
  mesh.faces.resize(3, from.faces_size() / 3);
  for (int i = 0; i < from.faces_size(); ++i) {
    if (from.faces(i) >= static_cast<uint64_t>(mesh.vertices.cols())) {
      reader.Violate("faces", absl::StrCat("face ", i / 3, " names vertex ", from.faces(i), " of ",
                                           mesh.vertices.cols()));
      return;
    }
    mesh.faces.data()[i] = static_cast<int>(from.faces(i));
  }
  if (!mesh.vertices.allFinite()) {
    reader.Violate("positions", "a coordinate is not finite");
    return;
  }
  if (ReadTags(from, &reader, &mesh)) control->user_mesh = std::move(mesh);
}

}  // namespace rilievo
