#include "client/formats/textured_mesh.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/atlas_layout.h"
#include "client/picture/png_bytes.h"
#include "core/base/status_macros.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// Between the two faces of a tile: filtering over an edge must not meet the other face.
constexpr int kGap = 1;

absl::StatusOr<int> TextureLevel(const DisplacedSurface& surface, int most_pixels) {
  for (int level = surface.max_level; level >= 0; --level) {
    const AtlasLayout layout(surface.control_mesh.faces.cols(), level, kGap);
    if (std::max(layout.width(), layout.height()) <= most_pixels) return level;
  }
  const AtlasLayout least(surface.control_mesh.faces.cols(), 0, kGap);
  return absl::InvalidArgumentError(absl::StrCat(
      "a texture of ", most_pixels, " pixels is too small for ", surface.control_mesh.faces.cols(),
      " control faces; give at least ", std::max(least.width(), least.height())));
}

// The sample beyond the third edge of a face that makes bilinear filtering linear along it.
Rgb Beyond(const Rgb& a, const Rgb& b, const Rgb& inner) {
  Rgb beyond;
  for (size_t k = 0; k < 3; ++k) {
    beyond[k] = static_cast<uint8_t>(std::clamp(a[k] + b[k] - inner[k], 0, 255));
  }
  return beyond;
}

std::vector<Rgb> Picture(const DisplacedSurface& surface, const Eigen::Matrix3Xi& triangles,
                         int level, const AtlasLayout& layout) {
  std::vector<Rgb> picture(static_cast<size_t>(layout.width() * layout.height()), Rgb{});
  for (Eigen::Index face = 0; face < triangles.cols(); ++face) {
    const int64_t in_control = face & ((int64_t{1} << (2 * level)) - 1);
    const std::array<Lattice, 3> corners = CornersOf(in_control, level);
    for (int k = 0; k < 3; ++k) {
      picture[layout.Place(face >> (2 * level), corners[k])] =
          surface.colors[static_cast<size_t>(triangles(k, face))];
    }
  }
  const int n = layout.n();
  for (int64_t face = 0; face < surface.control_mesh.faces.cols(); ++face) {
    const auto at = [&](int i, int j) -> Rgb& { return picture[layout.Place(face, {i, j})]; };
    for (int i = 1; i <= n; ++i) {
      const int j = n + 1 - i;
      at(i, j) = Beyond(at(i, j - 1), at(i - 1, j), at(i - 1, j - 1));
    }
  }
  return picture;
}

// The vertices of each control face by themselves.
void Separate(const DisplacedSurface& surface, TriangleMesh whole, int level,
              const AtlasLayout& layout, TexturedMesh* textured) {
  const std::vector<HeightSource> sources = SourcesAtLevel(surface, level);
  const int m = 1 << level;
  const double scale = static_cast<double>(layout.n()) / m;
  const int64_t control_faces = surface.control_mesh.faces.cols();
  const int64_t each = int64_t{m + 1} * (m + 2) / 2;
  TriangleMesh& mesh = textured->mesh;
  mesh.vertices.resize(3, control_faces * each);
  mesh.normals.resize(3, control_faces * each);
  mesh.triangles.resize(3, whole.triangles.cols());
  textured->texture.resize(2, control_faces * each);
  textured->sources.resize(static_cast<size_t>(control_faces * each));
  for (Eigen::Index face = 0; face < whole.triangles.cols(); ++face) {
    const int64_t control = face >> (2 * level);
    const std::array<Lattice, 3> corners =
        CornersOf(face & ((int64_t{1} << (2 * level)) - 1), level);
    for (int k = 0; k < 3; ++k) {
      const auto [i, j] = corners[k];
      const int64_t v = control * each + j * (2 * m + 3 - j) / 2 + i;  // rows get shorter by one
      const int from = whole.triangles(k, face);
      const std::array<double, 2> pixel = layout.At(control, scale * i, scale * j);
      mesh.triangles(k, face) = static_cast<int>(v);
      mesh.vertices.col(v) = whole.vertices.col(from);
      mesh.normals.col(v) = whole.normals.col(from);
      textured->sources[static_cast<size_t>(v)] = sources[static_cast<size_t>(from)];
      textured->texture.col(v) << static_cast<float>((pixel[0] + 0.5) / textured->width),
          static_cast<float>((pixel[1] + 0.5) / textured->height);
    }
  }
}

}  // namespace

absl::StatusOr<TexturedMesh> MakeTexturedMesh(const DisplacedSurface& surface, int level,
                                              int most_pixels, const RunContext& context) {
  if (surface.colors.empty()) {
    return absl::InvalidArgumentError("the surface has no colours for a texture");
  }
  if (level < 0 || level > surface.max_level) {
    return absl::InvalidArgumentError(
        absl::StrCat("level = ", level, ": a texture can be for 0 to ", surface.max_level));
  }
  TexturedMesh textured;
  RILIEVO_ASSIGN_OR_RETURN(textured.texture_level, TextureLevel(surface, most_pixels));
  const AtlasLayout layout(surface.control_mesh.faces.cols(), textured.texture_level, kGap);
  textured.width = static_cast<int>(layout.width());
  textured.height = static_cast<int>(layout.height());
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(surface.control_mesh, textured.texture_level, context));
  const std::vector<Rgb> picture =
      Picture(surface, refinement.levels.back().faces, textured.texture_level, layout);
  RILIEVO_ASSIGN_OR_RETURN(textured.png, PngBytes(PngPixels::kRgb8, textured.width, textured.height,
                                                  picture.data(), 3 * picture.size()));
  RILIEVO_ASSIGN_OR_RETURN(TriangleMesh whole, Tessellate(surface, level, context));
  Separate(surface, std::move(whole), level, layout, &textured);
  return textured;
}

}  // namespace rilievo
