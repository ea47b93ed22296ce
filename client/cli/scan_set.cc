#include "client/cli/scan_set.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/length_words.h"
#include "core/base/status_macros.h"
#include "core/geometry/merge_clouds.h"
#include "core/registration/scan_sample.h"

namespace rilievo {
namespace {

// What one of two scans says of a matter, or that it says nothing.
struct Saying {
  const char* matter;
  const char* option;
  std::string first, second;
};

std::vector<Saying> SayingsOf(const ScanPlace& first, const ScanPlace& second) {
  return {{"unit", "--unit", UnitName(first.metres_per_unit), UnitName(second.metres_per_unit)},
          {"way up", "--up", UpName(first.up), UpName(second.up)},
          {"coordinate reference system", "--crs", first.crs, second.crs}};
}

std::string Said(const std::string& word) {
  constexpr size_t kMost = 60;  // of a text of some thousand characters
  if (word.empty()) return "not known";
  return word.size() <= kMost ? word : absl::StrCat(word.substr(0, kMost), "...");
}

// Of each scan, where every scan has it.
template <typename T>
std::vector<T> Joined(const std::vector<PointLayers>& layers, const std::vector<PointCloud>& clouds,
                      std::vector<T> PointLayers::*field) {
  std::vector<T> all;
  for (size_t i = 0; i < layers.size(); ++i) {
    const std::vector<T>& own = layers[i].*field;
    if (own.size() != static_cast<size_t>(clouds[i].points.cols())) return {};
    all.insert(all.end(), own.begin(), own.end());
  }
  return all;
}

}  // namespace

absl::Status CheckSamePlace(const std::string& first_path, const ScanPlace& first,
                            const std::string& second_path, const ScanPlace& second) {
  std::vector<std::string> texts, options;
  for (const Saying& saying : SayingsOf(first, second)) {
    if (saying.first == saying.second) continue;
    texts.push_back(absl::StrCat("the ", saying.matter, " of the one is ", Said(saying.first),
                                 ", of the other ", Said(saying.second)));
    options.emplace_back(saying.option);
  }
  if (texts.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      first_path, " and ", second_path, ": ", absl::StrJoin(texts, "; "),
      "; bring them into one system first, or, where their coordinates are in one, say with ",
      absl::StrJoin(options, ", "), " which"));
}

absl::StatusOr<ScanSet> LoadScans(const std::vector<std::string>& paths,
                                  const ScanArguments& arguments, const PlaceArguments& given,
                                  const WantedLayers& wanted) {
  ScanSet set;
  set.paths = paths;
  for (const std::string& path : paths) {
    RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, LoadScan(path, arguments, wanted));
    const ScanPlace place = PlaceOf(given, scan.place);
    if (set.clouds.empty()) {
      set.place = place;
    } else {
      RILIEVO_RETURN_IF_ERROR(CheckSamePlace(paths[0], set.place, path, place));
    }
    set.formats.push_back(std::move(scan.format));
    set.clouds.push_back(std::move(scan.cloud));
    set.layers.push_back(std::move(scan.layers));
  }
  return set;
}

absl::StatusOr<Alignment> AlignSet(const RunContext& context, ScanSet* set) {
  absl::StatusOr<Alignment> alignment = AlignScans(set->clouds, AlignmentOptions{}, context);
  if (!alignment.ok()) {
    const auto scan = alignment.status().GetPayload(kScanPayload);
    if (!scan) return alignment.status();
    const size_t number = std::strtoul(std::string(*scan).c_str(), nullptr, 10);
    return absl::Status(alignment.status().code(),
                        absl::StrCat(set->paths[number], ": ", alignment.status().message()));
  }
  if (!alignment->IsSound()) return alignment;
  for (size_t i = 0; i < set->clouds.size(); ++i) {
    MoveCloud(alignment->moves[i], &set->clouds[i]);
  }
  return alignment;
}

absl::StatusOr<ScanFile> MergeSet(ScanSet set) {
  ScanFile merged;
  merged.layers.intensity = Joined(set.layers, set.clouds, &PointLayers::intensity);
  set.layers.clear();
  RILIEVO_ASSIGN_OR_RETURN(merged.cloud, MergeClouds(set.clouds));
  std::sort(set.formats.begin(), set.formats.end());
  set.formats.erase(std::unique(set.formats.begin(), set.formats.end()), set.formats.end());
  merged.format = absl::StrJoin(set.formats, ", ");
  merged.place = set.place;
  return merged;
}

std::string NameOfAll(const std::vector<std::string>& paths) {
  if (paths.size() == 1) return paths[0];
  return absl::StrCat(paths[0], " and ", paths.size() - 1, " more");
}

}  // namespace rilievo
