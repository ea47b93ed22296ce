// Where the vertices of a level stand in a picture: docs/displacement-atlas.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace rilievo {

// A vertex of a control face with the corners v0, v1, v2, at v0 + (i (v1 - v0) + j (v2 - v0)) / n.
struct Lattice {
  int i = 0, j = 0;
};

// Two control faces a tile, n = 2^level; tiles in rows.
class AtlasLayout {
 public:
  // `gap`: samples between the two faces of a tile. 0 or more.
  AtlasLayout(int64_t faces, int level, int gap);

  int n() const { return n_; }
  int columns() const { return columns_; }
  int64_t width() const { return columns_ * int64_t{n_ + 2 + gap_}; }
  int64_t height() const { return rows_ * int64_t{n_ + 1 + gap_}; }
  // Column and row of the sample at (i, j) of a control face; also between samples.
  std::array<double, 2> At(int64_t face, double i, double j) const;
  // Of a sample, its number in the picture, row by row.
  size_t Place(int64_t face, Lattice at) const;

 private:
  int n_, gap_;
  int64_t columns_, rows_;
};

// Where the corners of a face of `level` lie in its control face, of which it is the one with this
// number.
std::array<Lattice, 3> CornersOf(int64_t face_in_control, int level);

}  // namespace rilievo
