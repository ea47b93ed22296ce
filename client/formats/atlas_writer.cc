#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"
#include "client/formats/surface_writer.h"
#include "client/picture/gray_image.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kMostSamples = int64_t{1} << 30;

struct Lattice {
  int i = 0, j = 0;
};

// Two control faces a tile of (n + 2) x (n + 1) samples, n = 2^level; tiles in rows.
struct AtlasLayout {
  int n = 1, columns = 1, rows = 1;

  int width() const { return columns * (n + 2); }
  int height() const { return rows * (n + 1); }
  // Of the sample at (i, j) of a control face, i + j <= n.
  size_t Place(int64_t face, Lattice at) const {
    const int64_t tile = face / 2;
    int64_t x = at.i, y = at.j;
    if (face % 2 == 1) {
      x = n + 1 - x;
      y = n - y;
    }
    x += tile % columns * (n + 2);
    y += tile / columns * (n + 1);
    return static_cast<size_t>(y * width() + x);
  }
};

absl::StatusOr<AtlasLayout> LayOutAtlas(int64_t faces, int level) {
  AtlasLayout layout;
  layout.n = 1 << level;
  const int64_t tiles = (faces + 1) / 2;
  const int64_t samples = tiles * (layout.n + 1) * (layout.n + 2);
  if (samples > kMostSamples) {
    return absl::InvalidArgumentError(absl::StrCat("the atlas of level ", level, " would have ",
                                                   samples, " samples, at most ", kMostSamples,
                                                   " are written; take a lower level"));
  }
  layout.columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(tiles))));
  layout.rows = static_cast<int>((tiles + layout.columns - 1) / layout.columns);
  return layout;
}

// Where the corners of the faces of level l lie on the lattice of their control face: those of face
// 4 f + k from those of face f (loop/refinement.h).
std::array<Lattice, 3> Child(const std::array<Lattice, 3>& face, int k) {
  const auto middle = [](Lattice a, Lattice b) {
    return Lattice{(a.i + b.i) / 2, (a.j + b.j) / 2};
  };
  const Lattice m0 = middle(face[0], face[1]), m1 = middle(face[1], face[2]),
                m2 = middle(face[2], face[0]);
  switch (k) {
    case 0:
      return {face[0], m0, m2};
    case 1:
      return {m0, face[1], m1};
    case 2:
      return {m2, m1, face[2]};
    default:
      return {m1, m2, m0};
  }
}

std::array<Lattice, 3> CornersOf(int64_t face_in_control, int level) {
  const int n = 1 << level;
  std::array<Lattice, 3> corners = {Lattice{0, 0}, Lattice{n, 0}, Lattice{0, n}};
  for (int l = level - 1; l >= 0; --l) {
    corners = Child(corners, static_cast<int>(face_in_control >> (2 * l) & 3));
  }
  return corners;
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
  GrayImage image{layout.width(), layout.height(), {}, {}};
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
                 {"Columns", absl::StrCat(layout.columns)},
                 {"Minimum", Text(least * diagonal)},
                 {"Maximum", Text((least + range) * diagonal)}};
  RILIEVO_ASSIGN_OR_RETURN(const std::string png, EncodePng(image));
  out.write(png.data(), static_cast<std::streamsize>(png.size()));
  return absl::OkStatus();
}

}  // namespace rilievo
