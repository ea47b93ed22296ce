#include "core/pipeline/position_step.h"

#include <algorithm>
#include <vector>

namespace rilievo {
namespace {

constexpr double kFinest = 4e-4, kCoarsest = 5e-3;
constexpr double kOfShortEdges = 0.1, kShort = 0.05;  // the edge that 5 % are shorter than
constexpr double kOfCodingError = 4, kUsualCodingError = 1e-4;
constexpr int kEdgesPerCrease = 50;  // a part with fewer creases than that counts as smooth

double ShortEdge(const ControlMesh& mesh) {
  std::vector<double> lengths;
  lengths.reserve(static_cast<size_t>(mesh.faces.size()));
  for (const auto face : mesh.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      lengths.push_back((mesh.vertices.col(face[k]) - mesh.vertices.col(face[(k + 1) % 3])).norm());
    }
  }
  if (lengths.empty()) return 0;
  const auto short_edge =
      lengths.begin() + static_cast<std::ptrdiff_t>(kShort * static_cast<double>(lengths.size()));
  std::nth_element(lengths.begin(), short_edge, lengths.end());
  return *short_edge;
}

}  // namespace

bool IsMachined(const ControlMesh& mesh) {
  return static_cast<int64_t>(mesh.creases.size()) * kEdgesPerCrease > 3 * mesh.faces.cols() / 2;
}

double PositionStepFor(const ControlMesh& mesh, std::optional<double> coding_error) {
  const double smooth = std::clamp(kOfShortEdges * ShortEdge(mesh), kFinest, kCoarsest);
  if (!IsMachined(mesh)) return smooth;
  const double flat = kOfCodingError * coding_error.value_or(kUsualCodingError);
  return std::clamp(flat, kFinest, smooth);
}

}  // namespace rilievo
