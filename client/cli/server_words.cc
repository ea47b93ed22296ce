#include "client/cli/server_words.h"

#include <array>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/library/status_conversion.h"

namespace rilievo {
namespace {

// By the last word of the path, or by a word within it.
constexpr std::array<std::pair<absl::string_view, const char*>, 26> kOptions = {{
    {"max_level", "--max-level"},
    {"threads", "--threads"},
    {"seed", "--seed"},
    {"topology", "--topology"},
    {"boundary", "--boundary"},
    {"outlier_distance_factor", "--outliers"},
    {"stations", "--stations"},
    {"normals", "--normals"},
    {"close_holes_below_ratio", "--close-holes-below"},
    {"close_holes_below_length", "--close-holes-below"},
    {"bridge_gaps_below_ratio", "--bridge-gaps-below"},
    {"bridge_gaps_below_length", "--bridge-gaps-below"},
    {"creases", "--creases"},
    {"scheme", "--scheme"},
    {"control_faces", "--control-faces"},
    {"control_mesh", "--control-mesh"},
    {"method", "--fit"},
    {"max_error_ratio", "--max-error"},
    {"max_bytes", "--max-bytes"},
    {"height_step_ratio", "--height-step"},
    {"max_error_length", "--max-error"},
    {"height_step_length", "--height-step"},
    {"metres_per_unit", "--unit"},
    {"up", "--up"},
    {"crs", "--crs"},
    {"request_id", "--request-id"},
}};

}  // namespace

std::string OptionOfField(absl::string_view field) {
  for (const auto& [word, option] : kOptions) {
    if (field == word || absl::EndsWith(field, absl::StrCat(".", word)) ||
        absl::StrContains(field, absl::StrCat(".", word, "."))) {
      return option;
    }
  }
  for (const char* shape : {"points", "triangles", "base"}) {
    if (field == shape || absl::StartsWith(field, absl::StrCat(shape, "."))) return "";
  }
  if (absl::EndsWith(field, "point_count") || absl::EndsWith(field, "triangle_count")) return "";
  const size_t dot = field.rfind('.');
  return std::string(dot == absl::string_view::npos ? field : field.substr(dot + 1));
}

std::string WordsOf(const absl::Status& status) {
  std::string words;
  for (const ViolatedField& violated : ViolatedFields(status)) {
    const std::string option = OptionOfField(violated.field);
    absl::StrAppend(&words, words.empty() ? "" : "; ", option, option.empty() ? "" : ": ",
                    violated.description);
  }
  return words.empty() ? std::string(status.message()) : words;
}

}  // namespace rilievo
