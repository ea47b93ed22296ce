#include "client/formats/meshopt/unpack_rows.h"

#include <meshoptimizer.h>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// A byte holds at most so many: the bits that say of 16 bytes of attributes that all are alike, a
// triangle of corners of 32 bits, or one such corner.
constexpr uint64_t kMostAttributeBytes = 64, kMostTriangleBytes = 12, kMostIndexBytes = 4;

absl::Status CheckPacked(const PackedRows& packed) {
  const uint64_t stride = packed.stride;
  uint64_t most = 0;
  bool good = false;
  if (packed.mode == "ATTRIBUTES") {
    most = kMostAttributeBytes;
    good = stride >= 4 && stride <= 256 && stride % 4 == 0;
  } else if (packed.mode == "TRIANGLES" || packed.mode == "INDICES") {
    const bool triangles = packed.mode == "TRIANGLES";
    most = triangles ? kMostTriangleBytes : kMostIndexBytes;
    good = (stride == 2 || stride == 4) && (!triangles || packed.rows % 3 == 0);
  }
  if (!good) {
    return absl::InvalidArgumentError(absl::StrCat("mode '", packed.mode, "' with ", packed.rows,
                                                   " rows of ", stride, " bytes is not known"));
  }
  const std::string& filter = packed.filter;
  const bool known = filter == "NONE" || (filter == "OCTAHEDRAL" && (stride == 4 || stride == 8)) ||
                     (filter == "QUATERNION" && stride == 8) || filter == "EXPONENTIAL";
  if (!known || (filter != "NONE" && packed.mode != "ATTRIBUTES")) {
    return absl::InvalidArgumentError(
        absl::StrCat("filter '", filter, "' of rows of ", stride, " bytes is not known"));
  }
  if (packed.rows <= packed.bytes.size() * most / stride) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(packed.bytes.size(), " bytes cannot hold ",
                                                 packed.rows, " rows of ", stride, " bytes"));
}

}  // namespace

absl::StatusOr<std::string> UnpackRows(const PackedRows& packed) {
  RILIEVO_RETURN_IF_ERROR(CheckPacked(packed));
  std::string rows(packed.rows * packed.stride, '\0');
  const auto* bytes = reinterpret_cast<const unsigned char*>(packed.bytes.data());
  using Decoder = int (*)(void*, size_t, size_t, const unsigned char*, size_t);
  Decoder decode = meshopt_decodeVertexBuffer;
  if (packed.mode == "TRIANGLES") decode = meshopt_decodeIndexBuffer;
  if (packed.mode == "INDICES") decode = meshopt_decodeIndexSequence;
  if (decode(rows.data(), packed.rows, packed.stride, bytes, packed.bytes.size()) != 0) {
    return absl::DataLossError(
        absl::StrCat("EXT_meshopt_compression: ", packed.bytes.size(), " bytes of ", packed.mode,
                     " are damaged, or of a newer version; export the mesh without compression"));
  }
  if (packed.filter == "OCTAHEDRAL") {
    meshopt_decodeFilterOct(rows.data(), packed.rows, packed.stride);
  } else if (packed.filter == "QUATERNION") {
    meshopt_decodeFilterQuat(rows.data(), packed.rows, packed.stride);
  } else if (packed.filter == "EXPONENTIAL") {
    meshopt_decodeFilterExp(rows.data(), packed.rows, packed.stride);
  }
  return rows;
}

}  // namespace rilievo
