#include "client/formats/obj_lines.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// Leaves the words behind the position.
absl::Status ParseVertex(std::string_view* words, Eigen::Vector3d* position) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = NextWord(words);
    if (word.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("a vertex of ", axis, " coordinates"));
    }
    RILIEVO_RETURN_IF_ERROR(ParseNumber(word, &(*position)(axis)));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status VisitObjLines(ByteSource* source, const ObjVisitor& visitor) {
  std::string joined;
  for (;;) {
    std::string_view line;
    const ByteSource::Line result = source->NextLine(&line);
    if (result == ByteSource::Line::kEnd) return absl::OkStatus();
    if (result == ByteSource::Line::kTooLong || line.find('\0') != std::string_view::npos ||
        joined.size() > ByteSource::kMaxLine) {
      return absl::InvalidArgumentError(
          absl::StrCat("OBJ, after line ", source->line_number(),
                       ": binary data or a line over 1 MiB; is this an OBJ file?"));
    }
    if (!line.empty() && line.back() == '\\') {
      joined.append(line.substr(0, line.size() - 1));
      joined += ' ';
      continue;
    }
    if (!joined.empty()) {
      joined.append(line);
      line = joined;
    }
    absl::Status status;
    const std::string_view keyword = NextWord(&line);
    if (keyword == "v") {
      Eigen::Vector3d position;
      status = ParseVertex(&line, &position);
      if (status.ok()) status = visitor.vertex(position, line);
    } else if (keyword == "f" && visitor.face) {
      status = visitor.face(line);
    } else if (keyword == "t" && visitor.tag) {
      status = visitor.tag(line);
    }
    if (!status.ok()) {
      return absl::Status(
          status.code(), absl::StrCat("OBJ, line ", source->line_number(), ": ", status.message()));
    }
    joined.clear();
  }
}

std::optional<std::array<double, 3>> ParseObjColor(std::string_view words) {
  words = words.substr(0, words.find('#'));
  std::array<double, 3> channels{};
  size_t count = 0;
  for (auto word = NextWord(&words); !word.empty(); word = NextWord(&words), ++count) {
    if (count == channels.size() || !ParseNumber(word, &channels[count]).ok()) return std::nullopt;
  }
  if (count < channels.size()) return std::nullopt;
  return channels;
}

}  // namespace rilievo
