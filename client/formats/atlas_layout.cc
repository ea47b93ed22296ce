#include "client/formats/atlas_layout.h"

#include <cmath>

namespace rilievo {
namespace {

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

}  // namespace

AtlasLayout::AtlasLayout(int64_t faces, int level, int gap) : n_(1 << level), gap_(gap) {
  const int64_t tiles = (faces + 1) / 2;
  columns_ = static_cast<int64_t>(std::ceil(std::sqrt(static_cast<double>(tiles))));
  rows_ = (tiles + columns_ - 1) / columns_;
}

std::array<double, 2> AtlasLayout::At(int64_t face, double i, double j) const {
  const int64_t tile = face / 2;
  const double x = face % 2 == 0 ? i : n_ + 1 + gap_ - i, y = face % 2 == 0 ? j : n_ + gap_ - j;
  return {static_cast<double>(tile % columns_ * (n_ + 2 + gap_)) + x,
          static_cast<double>(tile / columns_ * (n_ + 1 + gap_)) + y};
}

size_t AtlasLayout::Place(int64_t face, Lattice at) const {
  const auto [x, y] = At(face, at.i, at.j);
  return static_cast<size_t>(y) * static_cast<size_t>(width()) + static_cast<size_t>(x);
}

std::array<Lattice, 3> CornersOf(int64_t face_in_control, int level) {
  const int n = 1 << level;
  std::array<Lattice, 3> corners = {Lattice{0, 0}, Lattice{n, 0}, Lattice{0, n}};
  for (int l = level - 1; l >= 0; --l) {
    corners = Child(corners, static_cast<int>(face_in_control >> (2 * l) & 3));
  }
  return corners;
}

}  // namespace rilievo
