// rilievo_accuracy: how close reconstructions come to the truth, against the table in the tree.
//   rilievo_accuracy [--fast] [--only SHAPE]... [--seeds N] [--without NAME]...
//                    [--set NAME=VALUE]... [--compare FILE | --write FILE]
//   rilievo_accuracy --ablation [--fast] [--only SHAPE]... [--seeds N] [--without NAME]...
//   rilievo_accuracy --sensitivity [--fast] [--only SHAPE]... [--seeds N] [--of NAME]...
// --fast: only scans of 20 000 points. --seeds: means over so many scans a row. --without: leaves a
// mechanism of the core out. --ablation: the table of what each of the mechanisms named, or each
// there is, earns. --set: gives a setting of the core another value. --sensitivity: the table of
// what more and less of each setting does, or of those whose names begin as --of says. All four in
// a build with the CMake option RILIEVO_ABLATION. --compare: exit code 1 if a row is worse than in
// the table of FILE, see CompareTables(). --write: puts the rows into the table of FILE in place of
// what it held.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "tests/accuracy/ablation_table.h"
#include "tests/accuracy/accuracy_table.h"

namespace rilievo {
namespace {

struct Arguments {
  bool fast = false, ablation = false, sensitivity = false;
  int seeds = 1;
  std::vector<std::string> only, without, set, of;
  std::string compare, write;
};

bool TakesValue(std::string_view word) {
  return word == "--only" || word == "--seeds" || word == "--without" || word == "--compare" ||
         word == "--write" || word == "--set" || word == "--of";
}

absl::StatusOr<Arguments> ReadArguments(int count, char** words) {
  Arguments arguments;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const auto value = [&]() -> std::string { return i + 1 < count ? words[++i] : ""; };
    if (i + 1 == count && TakesValue(word)) {
      return absl::InvalidArgumentError(absl::StrCat(word, " takes a value"));
    }
    if (word == "--fast") {
      arguments.fast = true;
    } else if (word == "--only") {
      arguments.only.push_back(value());
    } else if (word == "--seeds") {
      const std::string number = value();
      if (!absl::SimpleAtoi(number, &arguments.seeds) || arguments.seeds < 1) {
        return absl::InvalidArgumentError(
            absl::StrCat("--seeds ", number, ": at least 1 is needed"));
      }
    } else if (word == "--ablation") {
      arguments.ablation = true;
    } else if (word == "--sensitivity") {
      arguments.sensitivity = true;
    } else if (word == "--set") {
      arguments.set.push_back(value());
    } else if (word == "--of") {
      arguments.of.push_back(value());
    } else if (word == "--without") {
      arguments.without.push_back(value());
    } else if (word == "--compare") {
      arguments.compare = value();
    } else if (word == "--write") {
      arguments.write = value();
    } else {
      return absl::InvalidArgumentError(absl::StrCat("unknown argument ", word));
    }
  }
  return arguments;
}

std::vector<SubjectName> SubjectsFor(const Arguments& arguments) {
  constexpr int64_t kSmall = 20000, kMedium = 100000, kLarge = 1000000;
  // Several times as thick as these points are apart.
  constexpr double kThick = 1;
  static const std::set<std::string> kThickShapes = {"bracket-growing", "cutbox", "genus2",
                                                     "genus2-growing",  "pair",   "terrain"};
  std::vector<SubjectName> subjects;
  for (const int64_t points : {kSmall, kMedium, kLarge}) {
    if (arguments.fast && points > kSmall) continue;
    for (const std::string& shape : SubjectShapes()) {
      const auto& only = arguments.only;
      if (!only.empty() && std::find(only.begin(), only.end(), shape) == only.end()) continue;
      if (points == kLarge && !shape.starts_with("street")) continue;
      for (const double noise : {0.0, 0.1, 0.3, kThick}) {
        if (points == kLarge && noise > 0) continue;
        if (noise == kThick && (points != kMedium || kThickShapes.count(shape) == 0)) continue;
        if (noise != kThick && shape.ends_with("-growing")) continue;
        subjects.push_back({shape, noise, points});
      }
    }
  }
  return subjects;
}

std::string TextOf(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// The table of a document with these rows in place of its own for the same scans, or after them.
absl::Status WriteRows(const std::string& path, const std::vector<AccuracyRow>& measured) {
  const std::string text = TextOf(path);
  RILIEVO_ASSIGN_OR_RETURN(std::vector<AccuracyRow> rows, ReadTable(text));
  for (const AccuracyRow& row : measured) {
    const auto same = std::find_if(rows.begin(), rows.end(), [&](const AccuracyRow& old) {
      return LabelOf(old.subject) == LabelOf(row.subject);
    });
    if (same != rows.end()) {
      *same = row;
    } else {
      rows.push_back(row);
    }
  }
  const std::string table = FormatTable(rows);
  const size_t begin = text.find(table.substr(0, table.find('\n')));
  if (begin == std::string::npos) {
    return absl::FailedPreconditionError(absl::StrCat(path, " has no accuracy table"));
  }
  size_t end = begin;
  while (end < text.size() && text[end] == '|')
    end = std::min(text.find('\n', end), text.size() - 1) + 1;
  std::ofstream file(path);
  file << text.substr(0, begin) << table << text.substr(end);
  if (!file.flush()) return absl::UnavailableError(absl::StrCat(path, " cannot be written"));
  return absl::OkStatus();
}

absl::Status Set(const std::string& text) {
  const size_t equals = text.find('=');
  double value = 0;
  if (equals == std::string::npos || !absl::SimpleAtod(text.substr(equals + 1), &value)) {
    return absl::InvalidArgumentError(absl::StrCat("--set ", text, ": NAME=NUMBER is needed"));
  }
  return SetByName(text.substr(0, equals), value);
}

absl::Status Run(const Arguments& arguments) {
  const std::vector<std::string> shapes = SubjectShapes();
  for (const std::string& shape : arguments.only) {
    if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("--only ", shape, ": the shapes are ", absl::StrJoin(shapes, ", ")));
    }
  }
  for (const std::string& text : arguments.set) RILIEVO_RETURN_IF_ERROR(Set(text));
  if (arguments.ablation) {
    return MeasureAblation(SubjectsFor(arguments), arguments.without, arguments.seeds).status();
  }
  if (arguments.sensitivity) {
    return MeasureSensitivity(SubjectsFor(arguments), arguments.of, arguments.seeds).status();
  }
  for (const std::string& name : arguments.without) RILIEVO_RETURN_IF_ERROR(LeaveOutByName(name));
  std::vector<AccuracyRow> rows;
  for (const SubjectName& name : SubjectsFor(arguments)) {
    RILIEVO_ASSIGN_OR_RETURN(const AccuracyFigures figures,
                             MeasureAccuracy(name, arguments.seeds, RunContext{}));
    rows.push_back({name, figures});
    const std::string table = FormatTable({rows.back()});
    std::cout << (rows.size() == 1 ? table : table.substr(table.rfind("\n|") + 1)) << std::flush;
  }
  if (!arguments.write.empty()) return WriteRows(arguments.write, rows);
  if (arguments.compare.empty()) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<AccuracyRow> before,
                           ReadTable(TextOf(arguments.compare)));
  const AccuracyComparison comparison = CompareTables(before, rows);
  std::printf("%d rows, against %s: RMS %.4f, Hausdorff %.4f, bytes %.4f, time %.3f\n",
              comparison.rows, arguments.compare.c_str(), comparison.rms, comparison.hausdorff,
              comparison.bytes, comparison.microseconds);
  for (const std::string& sentence : comparison.worse) std::printf("WORSE %s\n", sentence.c_str());
  if (comparison.rows < static_cast<int>(rows.size())) {
    return absl::FailedPreconditionError(absl::StrCat(
        arguments.compare, " lacks ", rows.size() - comparison.rows, " of the rows measured"));
  }
  if (!comparison.worse.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat(comparison.worse.size(), " figures are worse"));
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace rilievo

int main(int count, char** words) {
  const auto arguments = rilievo::ReadArguments(count, words);
  const absl::Status status = arguments.ok() ? rilievo::Run(*arguments) : arguments.status();
  if (!status.ok()) std::cerr << "rilievo_accuracy: " << status.message() << "\n";
  return status.ok() ? 0 : 1;
}
