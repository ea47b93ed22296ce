// The header of a PLY file (Turk 1994).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/byte_source.h"
#include "client/formats/scalar_type.h"

namespace rilievo {

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::kF32;  // of the value, or of a list's items
  bool is_list = false;
  ScalarType count_type = ScalarType::kU8;  // integer; of a list's count
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;  // as claimed; see CheckElementFits
  std::vector<PlyProperty> properties;

  // -1 when there is none of this name, -2 when there are several.
  int Find(std::string_view property) const;
  // Fewest bytes that one element takes in the body.
  uint64_t LeastBytes(bool ascii) const;
};

struct PlyHeader {
  enum class Format { kAscii, kLittleEndian, kBigEndian };
  Format format = Format::kAscii;
  std::vector<PlyElement> elements;

  bool ascii() const { return format == Format::kAscii; }
};

const char* PlyFormatName(PlyHeader::Format format);

// Reads up to and with the line end of "end_header", LF or CRLF. INVALID_ARGUMENT that names the
// line and what was found; DATA_LOSS when the bytes end before.
absl::StatusOr<PlyHeader> ReadPlyHeader(ByteSource* source);

// DATA_LOSS when the bytes left cannot hold as many elements as are claimed. Nothing may be
// allocated by a claimed count before this.
absl::Status CheckElementFits(const PlyElement& element, bool ascii, const ByteSource& source);

}  // namespace rilievo
