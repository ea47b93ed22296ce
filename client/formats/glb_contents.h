// What a binary glTF 2.0 file of one mesh holds, column by column, before it is written.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/block_writer.h"
#include "client/formats/number_text.h"
#include "core/geometry/scan_place.h"

namespace rilievo {

// Names of the format (glTF 2.0, section 3.6.2.2).
inline constexpr int kGlbByte = 5120, kGlbUnsignedByte = 5121, kGlbUnsignedShort = 5123,
                     kGlbUnsignedInt = 5125, kGlbFloat = 5126;

// Rows of numbers: an attribute of the vertices, the corners of the triangles, or of a clip.
struct GlbColumn {
  std::string attribute;  // "POSITION", "_SOURCE"; empty: the corners of the triangles
  int component = kGlbFloat;
  const char* type = "SCALAR";
  uint64_t rows = 0;
  int stride = 0;  // bytes of a row, a multiple of 4
  bool normalized = false;
  std::string bounds = {};  // of POSITION: members min and max, each with a comma before it
  uint64_t bytes = 0;       // that `write` writes: rows * stride, unless they are compressed
  std::function<void(BlockWriter*)> write = {};
  // Of EXT_meshopt_compression: "ATTRIBUTES" or "TRIANGLES", and "OCTAHEDRAL"; nullptr: none.
  const char* mode = nullptr;
  const char* filter = nullptr;
  // Of a clip (glb_clip.h): the morph target whose attribute it is, or numbers of its animation.
  int target = -1;
  bool of_animation = false;
};

struct GlbContents {
  std::vector<GlbColumn> columns;  // the corners of the triangles come last
  // A position in the file, scaled and then moved, is one of the scan.
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double scale = 1;
  bool has_colors = false;           // of vertices or of the picture
  const std::string* png = nullptr;  // the picture of TEXCOORD_0
};

// "[x,y,z]".
template <typename Vector>
std::string GlbRow(const Vector& values) {
  std::string text = "[";
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0) text += ',';
    AppendNumber(values(axis), &text);
  }
  return text + ']';
}

// One mesh of one primitive. A node above that of the mesh turns the way up of `place` (z where it
// is not known) to y and scales to metres. INVALID_ARGUMENT beyond the 4 GiB of the format.
absl::Status WriteGlbContents(const GlbContents& contents, const ScanPlace& place,
                              std::ostream& out);

}  // namespace rilievo
