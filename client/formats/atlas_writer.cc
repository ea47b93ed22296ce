#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/atlas_layout.h"
#include "client/formats/number_text.h"
#include "client/formats/surface_writer.h"
#include "client/picture/gray_image.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kMostSamples = int64_t{1} << 30;

absl::StatusOr<AtlasLayout> LayOutAtlas(int64_t faces, int level) {
  const AtlasLayout layout(faces, level, 0);
  const int64_t samples = layout.width() * layout.height();
  if (samples > kMostSamples) {
    return absl::InvalidArgumentError(absl::StrCat("the atlas of level ", level, " would have ",
                                                   samples, " samples, at most ", kMostSamples,
                                                   " are written; take a lower level"));
  }
  return layout;
}

std::string Text(double value) {
  std::string text;
  AppendNumber(value, &text);
  return text;
}

}  // namespace

absl::Status WriteDisplacementAtlas(const DisplacedSurface& surface, int level,
                                    const RunContext& context, std::ostream& out) {
  if (level < 0 || level > surface.max_level) {
    return absl::InvalidArgumentError(absl::StrCat("level = ", level,
                                                   ": an atlas can be written for 0 to ",
                                                   surface.max_level, ", the levels of heights"));
  }
  const int64_t faces = surface.control_mesh.faces.cols();
  RILIEVO_ASSIGN_OR_RETURN(const AtlasLayout layout, LayOutAtlas(faces, level));
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh mesh, Tessellate(surface, level, context));
  const auto count = static_cast<std::ptrdiff_t>(mesh.vertices.cols());
  const auto [low, high] =
      std::minmax_element(surface.heights.begin(), surface.heights.begin() + count);
  const double least = *low, range = static_cast<double>(*high) - least;
  GrayImage image{static_cast<int>(layout.width()), static_cast<int>(layout.height()), {}, {}};
  image.samples.assign(static_cast<size_t>(image.width) * image.height, 0);
  for (Eigen::Index face = 0; face < mesh.triangles.cols(); ++face) {
    const int64_t in_control = face & ((int64_t{1} << (2 * level)) - 1);
    const std::array<Lattice, 3> corners = CornersOf(in_control, level);
    for (int k = 0; k < 3; ++k) {
      const double height = surface.heights[static_cast<size_t>(mesh.triangles(k, face))];
      const double share = range > 0 ? (height - least) / range : 0;
      image.samples[layout.Place(face >> (2 * level), corners[k])] =
          static_cast<uint16_t>(std::lround(share * 65535));
    }
  }
  const double diagonal = surface.frame.diagonal;
  image.texts = {{"Title", "rilievo displacement atlas 1"},
                 {"Level", absl::StrCat(level)},
                 {"Faces", absl::StrCat(faces)},
                 {"Columns", absl::StrCat(layout.columns())},
                 {"Minimum", Text(least * diagonal)},
                 {"Maximum", Text((least + range) * diagonal)}};
  RILIEVO_ASSIGN_OR_RETURN(const std::string png, EncodePng(image));
  out.write(png.data(), static_cast<std::streamsize>(png.size()));
  return absl::OkStatus();
}

}  // namespace rilievo
