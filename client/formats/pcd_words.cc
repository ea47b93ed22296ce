#include "client/formats/pcd_words.h"

#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"

namespace rilievo {
namespace {

std::vector<std::string> Words(std::string_view line) {
  std::vector<std::string> words;
  for (std::string_view word = NextWord(&line); !word.empty(); word = NextWord(&line)) {
    words.emplace_back(word);
  }
  return words;
}

}  // namespace

absl::Status PcdHeaderError(absl::string_view entry, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("PCD header, ", entry, ": ", what));
}

absl::StatusOr<PcdWords> ReadPcdWords(ByteSource* source) {
  PcdWords words;
  size_t bytes = 0;
  std::string_view line;
  while (words.data.empty()) {
    const ByteSource::Line result = source->NextLine(&line);
    if (result == ByteSource::Line::kEnd || !source->line_was_ended()) {
      return absl::DataLossError("PCD header: the bytes end before the DATA line; truncated file?");
    }
    bytes += line.size();
    if (result == ByteSource::Line::kTooLong || bytes > (size_t{1} << 20)) {
      return absl::InvalidArgumentError("PCD header: longer than 1 MiB; is this a PCD file?");
    }
    const std::string_view text = line.substr(0, line.find('#'));
    std::string_view rest = text;
    const std::string_view key = NextWord(&rest);
    if (key == "FIELDS" || key == "COLUMNS")
      words.fields = Words(rest);
    else if (key == "SIZE")
      words.size = Words(rest);
    else if (key == "TYPE")
      words.type = Words(rest);
    else if (key == "COUNT")
      words.count = Words(rest);
    else if (key == "WIDTH")
      words.width = Words(rest);
    else if (key == "HEIGHT")
      words.height = Words(rest);
    else if (key == "POINTS")
      words.points = Words(rest);
    else if (key == "VIEWPOINT")
      words.viewpoint = Words(rest);
    else if (key == "DATA") {
      words.data = Words(rest);
      if (words.data.empty()) return PcdHeaderError("DATA", "names no format");
    } else if (!key.empty() && key != "VERSION") {
      return absl::InvalidArgumentError(absl::StrCat("PCD header, line ", source->line_number(),
                                                     ": unknown entry ", Quoted(key)));
    }
  }
  return words;
}

}  // namespace rilievo
