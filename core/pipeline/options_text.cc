#include "core/pipeline/options_text.h"

#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Names = std::span<const char* const>;
constexpr std::array kSightRules = {"auto", "use", "ignore"};
constexpr std::array kTopologies = {"auto", "planar", "spherical", "arbitrary", "user"};
constexpr std::array kBoundaries = {"keep", "close", "exact"};
constexpr std::array kCreases = {"auto", "off"};
constexpr std::array kSchemesOfDomains = {"loop", "catmull-clark"};
constexpr std::array kMakings = {"memory", "parts"};
constexpr std::array kMethods = {"suzuki", "least-squares"};
static_assert(static_cast<int>(Topology::kAuto) == 0 && static_cast<int>(Topology::kUser) == 4);
static_assert(static_cast<int>(SightRule::kAuto) == 0);
static_assert(static_cast<int>(SightRule::kIgnore) == 2);
static_assert(static_cast<int>(BoundaryRule::kKeep) == 0);
static_assert(static_cast<int>(CreaseRule::kAuto) == 0);
static_assert(static_cast<int>(DomainScheme::kLoop) == 0);
static_assert(static_cast<int>(FitMethod::kSuzuki) == 0);

// Every option once: to write them, and to read them.
template <typename Visitor>
void VisitOptions(StatedOptions& stated, Visitor& visit) {
  ReconstructOptions& o = stated.options;
  visit("duplicate_distance", o.check.duplicate_distance);
  visit("neighbors", o.scan.neighbors.k);
  visit("distance_factor", o.scan.outliers.distance_factor);
  visit("min_component_share", o.scan.outliers.min_component_share);
  visit("stations", o.scan.sights.stations, Names(kSightRules));
  visit("normals", o.scan.sights.normals, Names(kSightRules));
  visit("topology", o.control.topology, Names(kTopologies));
  visit("boundary", o.control.boundary, Names(kBoundaries));
  visit("close_holes_below", o.control.close_holes_below);
  visit("bridge_gaps_below", o.control.bridge_gaps_below);
  visit("creases", o.control.creases, Names(kCreases));
  visit("scheme", o.control.scheme, Names(kSchemesOfDomains));
  visit("target_faces", o.control.target_faces);
  visit("method", o.fit.method, Names(kMethods));
  visit("suzuki_rounds", o.fit.suzuki_rounds);
  visit("suzuki_lambda", o.fit.suzuki_lambda);
  visit("rounds", o.fit.rounds);
  visit("sample_level", o.fit.sample_level);
  visit("tangential_weight", o.fit.tangential_weight);
  visit("fairness_start", o.fit.fairness_start);
  visit("fairness_end", o.fit.fairness_end);
  visit("robust_spacings", o.fit.robust_spacings);
  visit("max_height", o.displacement.max_height);
  visit("min_normal_agreement", o.displacement.min_normal_agreement);
  visit("height_step", o.encode.height_step);
  visit("position_step", o.encode.position_step);
  visit("max_error", o.encode.max_error);
  visit("max_bytes", o.encode.max_bytes);
  visit("noise_floor", o.encode.noise_floor);
  visit("smallest_hole", o.encode.smallest_hole);
  visit("max_level", o.max_level);
  visit("seed", stated.seed);
  bool by_parts = stated.parts.has_value();
  PartSizes sizes = stated.parts.value_or(PartSizes{});
  visit("made", by_parts, Names(kMakings));
  visit("part_sizes", sizes);
  if (by_parts) stated.parts = sizes;
}

// Options of earlier versions whose mechanisms are gone: files that state them are read.
constexpr std::array kRetired = {"max_queue", "max_triangle_spacings", "plane_noise_ratio",
                                 "smoothing_rounds"};

// Shortest text that reads back to the same number.
template <typename Number>
std::string Text(Number value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return std::string(text.data(), end);
}

template <typename Number>
bool Read(absl::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

// In the order of their struct: "4000000/1000000/500000".
std::string Text(const PartSizes& sizes) {
  return absl::StrCat(sizes.coarse_points, "/", sizes.part_points, "/", sizes.block_vertices);
}

bool Read(absl::string_view text, PartSizes& sizes) {
  const std::vector<absl::string_view> numbers = absl::StrSplit(text, '/');
  return numbers.size() == 3 && Read(numbers[0], sizes.coarse_points) &&
         Read(numbers[1], sizes.part_points) && Read(numbers[2], sizes.block_vertices);
}

class Writer {
 public:
  template <typename Number>
  void operator()(const char* name, const Number& value) {
    words.emplace_back(name, Text(value));
  }
  template <typename Number>
  void operator()(const char* name, const std::optional<Number>& value) {
    words.emplace_back(name, value ? Text(*value) : "");
  }
  template <typename Choice>
  void operator()(const char* name, const Choice& value, Names names) {
    words.emplace_back(name, names[static_cast<size_t>(value)]);
  }
  std::vector<std::pair<const char*, std::string>> words;
};

class Reader {
 public:
  explicit Reader(std::map<absl::string_view, absl::string_view> words)
      : words_(std::move(words)) {}

  template <typename Number>
  void operator()(const char* name, Number& value) {
    Take(name, [&](absl::string_view text) { return Read(text, value); });
  }
  template <typename Number>
  void operator()(const char* name, std::optional<Number>& value) {
    Take(name, [&](absl::string_view text) { return Read(text, value.emplace()); });
  }
  template <typename Choice>
  void operator()(const char* name, Choice& value, Names names) {
    Take(name, [&](absl::string_view text) {
      for (size_t i = 0; i < names.size(); ++i) {
        if (text != names[i]) continue;
        value = static_cast<Choice>(i);
        return true;
      }
      return false;
    });
  }
  absl::Status Finish() const {
    if (words_.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("the options hold '", words_.begin()->first, "=",
                                                   words_.begin()->second,
                                                   "', which this version does not know"));
  }

 private:
  template <typename Parse>
  void Take(const char* name, const Parse& parse) {
    const auto word = words_.find(name);
    if (word != words_.end() && parse(word->second)) words_.erase(word);
  }
  std::map<absl::string_view, absl::string_view> words_;
};

}  // namespace

std::string OptionsText(const ReconstructOptions& options, uint64_t seed,
                        const std::optional<PartSizes>& parts) {
  StatedOptions given{options, seed, parts}, usual;
  Writer words, defaults;
  VisitOptions(given, words);
  VisitOptions(usual, defaults);
  std::string text;
  for (size_t i = 0; i < words.words.size(); ++i) {
    if (words.words[i].second == defaults.words[i].second) continue;
    absl::StrAppend(&text, text.empty() ? "" : " ", words.words[i].first, "=",
                    words.words[i].second);
  }
  return text;
}

absl::StatusOr<StatedOptions> ReadOptionsText(absl::string_view text) {
  std::map<absl::string_view, absl::string_view> words;
  for (const absl::string_view word : absl::StrSplit(text, ' ', absl::SkipEmpty())) {
    words.insert(absl::StrSplit(word, absl::MaxSplits('=', 1)));
  }
  for (const char* name : kRetired) words.erase(name);
  StatedOptions stated;
  Reader reader(std::move(words));
  VisitOptions(stated, reader);
  RILIEVO_RETURN_IF_ERROR(reader.Finish());
  return stated;
}

}  // namespace rilievo
