#include "client/formats/ply_header.h"

#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kMaxHeaderBytes = size_t{16} << 20;

absl::Status HeaderError(const ByteSource& source, absl::string_view what) {
  return absl::InvalidArgumentError(
      absl::StrCat("PLY header, line ", source.line_number(), ": ", what));
}

std::optional<ScalarType> PlyType(std::string_view name) {
  constexpr std::pair<std::string_view, ScalarType> kTypes[] = {
      {"char", ScalarType::kI8},     {"int8", ScalarType::kI8},    {"uchar", ScalarType::kU8},
      {"uint8", ScalarType::kU8},    {"short", ScalarType::kI16},  {"int16", ScalarType::kI16},
      {"ushort", ScalarType::kU16},  {"uint16", ScalarType::kU16}, {"int", ScalarType::kI32},
      {"int32", ScalarType::kI32},   {"uint", ScalarType::kU32},   {"uint32", ScalarType::kU32},
      {"int64", ScalarType::kI64},   {"uint64", ScalarType::kU64}, {"float", ScalarType::kF32},
      {"float32", ScalarType::kF32}, {"double", ScalarType::kF64}, {"float64", ScalarType::kF64},
  };
  for (const auto& [known, type] : kTypes) {
    if (name == known) return type;
  }
  return std::nullopt;
}

absl::StatusOr<ScalarType> TypeOrError(const ByteSource& source, std::string_view word) {
  if (const std::optional<ScalarType> type = PlyType(word)) return *type;
  return HeaderError(source, absl::StrCat("unknown property type ", Quoted(word),
                                          "; known: char, uchar, short, ushort, int, uint, int64, "
                                          "uint64, float, double and int8 ... float64"));
}

absl::Status ParseFormat(const ByteSource& source, std::string_view rest, PlyHeader* header) {
  const std::string_view word = NextWord(&rest);
  if (word == "ascii") {
    header->format = PlyHeader::Format::kAscii;
  } else if (word == "binary_little_endian") {
    header->format = PlyHeader::Format::kLittleEndian;
  } else if (word == "binary_big_endian") {
    header->format = PlyHeader::Format::kBigEndian;
  } else {
    return HeaderError(source,
                       absl::StrCat("unknown format ", Quoted(word),
                                    "; known: ascii, binary_little_endian, binary_big_endian"));
  }
  return absl::OkStatus();
}

absl::Status ParseElement(const ByteSource& source, std::string_view rest, PlyHeader* header) {
  PlyElement element;
  element.name = std::string(NextWord(&rest));
  const std::string_view count = NextWord(&rest);
  if (element.name.empty() || !ParseCount(count, &element.count) || !NextWord(&rest).empty()) {
    return HeaderError(
        source, absl::StrCat("element ", Quoted(element.name), " claims the count ", Quoted(count),
                             "; it must be a whole number from 0 below 2^64"));
  }
  header->elements.push_back(std::move(element));
  return absl::OkStatus();
}

absl::Status ParseProperty(const ByteSource& source, std::string_view rest, PlyHeader* header) {
  if (header->elements.empty()) return HeaderError(source, "a property before any element");
  PlyProperty property;
  std::string_view word = NextWord(&rest);
  if (word == "list") {
    property.is_list = true;
    RILIEVO_ASSIGN_OR_RETURN(property.count_type, TypeOrError(source, NextWord(&rest)));
    if (!IsInteger(property.count_type)) {
      return HeaderError(source, "the count of a list must have an integer type");
    }
    word = NextWord(&rest);
  }
  RILIEVO_ASSIGN_OR_RETURN(property.type, TypeOrError(source, word));
  property.name = std::string(NextWord(&rest));
  if (property.name.empty()) return HeaderError(source, "a property without a name");
  header->elements.back().properties.push_back(std::move(property));
  return absl::OkStatus();
}

}  // namespace

int PlyElement::Find(std::string_view property) const {
  int found = -1;
  for (size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == property) found = found == -1 ? static_cast<int>(i) : -2;
  }
  return found;
}

uint64_t PlyElement::LeastBytes(bool ascii) const {
  if (ascii) return 2 * properties.size();  // one digit and one separator or line end each
  uint64_t bytes = 0;
  for (const PlyProperty& property : properties) {
    bytes += ScalarSize(property.is_list ? property.count_type : property.type);
  }
  return bytes;
}

const char* PlyFormatName(PlyHeader::Format format) {
  switch (format) {
    case PlyHeader::Format::kAscii:
      return "ascii";
    case PlyHeader::Format::kLittleEndian:
      return "binary_little_endian";
    case PlyHeader::Format::kBigEndian:
      return "binary_big_endian";
  }
  return "?";
}

absl::StatusOr<PlyHeader> ReadPlyHeader(ByteSource* source) {
  std::string_view line;
  if (source->NextLine(&line) != ByteSource::Line::kRead || line != "ply") {
    return absl::InvalidArgumentError("not a PLY file: the first line is not 'ply'");
  }
  PlyHeader header;
  bool has_format = false;
  size_t bytes = 0;
  for (;;) {
    const ByteSource::Line result = source->NextLine(&line);
    if (result == ByteSource::Line::kEnd || !source->line_was_ended()) {
      return absl::DataLossError("PLY header: the bytes end before 'end_header'; truncated file?");
    }
    bytes += line.size();
    if (result == ByteSource::Line::kTooLong || bytes > kMaxHeaderBytes) {
      return absl::InvalidArgumentError(
          absl::StrCat("PLY header, line ", source->line_number() + 1,
                       ": a line over 1 MiB or a header over 16 MiB; is this a PLY file?"));
    }
    std::string_view rest = line;
    const std::string_view keyword = NextWord(&rest);
    if (keyword == "end_header") break;
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "format") {
      RILIEVO_RETURN_IF_ERROR(ParseFormat(*source, rest, &header));
      has_format = true;
    } else if (keyword == "element") {
      RILIEVO_RETURN_IF_ERROR(ParseElement(*source, rest, &header));
    } else if (keyword == "property") {
      RILIEVO_RETURN_IF_ERROR(ParseProperty(*source, rest, &header));
    } else {
      return HeaderError(*source, absl::StrCat("unknown keyword ", Quoted(keyword)));
    }
  }
  if (!has_format) {
    return absl::InvalidArgumentError(
        "PLY header: no 'format' line; add 'format ascii 1.0' or the binary format of the body");
  }
  return header;
}

absl::Status CheckElementFits(const PlyElement& element, bool ascii, const ByteSource& source) {
  const uint64_t least = element.LeastBytes(ascii);
  if (least == 0 || !source.remaining()) return absl::OkStatus();
  // The last line of a text may lack its line end.
  const uint64_t held = (*source.remaining() + (ascii ? 1 : 0)) / least;
  if (element.count <= held) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(
      "PLY element ", Quoted(element.name), ": the header claims ", element.count, ", but the ",
      *source.remaining(), " bytes left hold at most ", held, "; truncated file or wrong count"));
}

}  // namespace rilievo
