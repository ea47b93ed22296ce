#include "tests/accuracy/accuracy_table.h"

#include <cmath>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr char kHead[] =
    "| scan | noise | points | RMS | Hausdorff | genus | wrong normals | false area | bytes | us "
    "per "
    "point |";
constexpr char kRule[] = "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";
constexpr int kColumns = 10;
constexpr double kRowTolerance = 0.03, kMeanTolerance = 0.01;
constexpr double kShareTolerance = 0.005;  // half of the last digit of a percentage

std::string FormatRow(const AccuracyRow& row) {
  const AccuracyFigures& f = row.figures;
  return absl::StrFormat("| %s | %.2g | %d | %.4g | %.4g | %d | %.2f | %.2f | %d | %.1f |",
                         row.subject.shape, row.subject.noise_percent, row.subject.points, f.rms,
                         f.hausdorff, f.genus, f.wrong_normals, f.false_area, f.bytes,
                         f.microseconds);
}

absl::StatusOr<AccuracyRow> ReadRow(absl::string_view line) {
  const auto refuse = [&] {
    return absl::InvalidArgumentError(absl::StrCat("not a row of the accuracy table: ", line));
  };
  absl::string_view inner = absl::StripAsciiWhitespace(line);
  if (!absl::ConsumePrefix(&inner, "|") || !absl::ConsumeSuffix(&inner, "|")) return refuse();
  std::vector<std::string> cells;
  for (const absl::string_view cell : absl::StrSplit(inner, '|')) {
    cells.emplace_back(absl::StripAsciiWhitespace(cell));
  }
  AccuracyRow row;
  if (cells.size() != kColumns) return refuse();
  row.subject.shape = cells[0];
  AccuracyFigures& f = row.figures;
  const bool read =
      absl::SimpleAtod(cells[1], &row.subject.noise_percent) &&
      absl::SimpleAtoi(cells[2], &row.subject.points) && absl::SimpleAtod(cells[3], &f.rms) &&
      absl::SimpleAtod(cells[4], &f.hausdorff) && absl::SimpleAtoi(cells[5], &f.genus) &&
      absl::SimpleAtod(cells[6], &f.wrong_normals) && absl::SimpleAtod(cells[7], &f.false_area) &&
      absl::SimpleAtoi(cells[8], &f.bytes) && absl::SimpleAtod(cells[9], &f.microseconds);
  if (!read) return refuse();
  return row;
}

const AccuracyRow* Find(const std::vector<AccuracyRow>& rows, const SubjectName& subject) {
  for (const AccuracyRow& row : rows) {
    if (LabelOf(row.subject) == LabelOf(subject)) return &row;
  }
  return nullptr;
}

// Ratios of one figure over the rows.
class Ratios {
 public:
  Ratios(std::string name, AccuracyComparison* comparison)
      : name_(std::move(name)), comparison_(*comparison) {}
  void Add(const SubjectName& subject, double before, double after) {
    if (!(before > 0) || !(after > 0)) return;
    sum_ += std::log(after / before);
    ++count_;
    if (after > (1 + kRowTolerance) * before) {
      comparison_.worse.push_back(
          absl::StrFormat("%s: %s was %.4g and is %.4g", LabelOf(subject), name_, before, after));
    }
  }
  double Mean() {
    const double mean = count_ > 0 ? std::exp(sum_ / count_) : 1;
    if (mean > 1 + kMeanTolerance) {
      comparison_.worse.push_back(
          absl::StrFormat("the geometric mean of %s is %.4f of what it was", name_, mean));
    }
    return mean;
  }

 private:
  std::string name_;
  AccuracyComparison& comparison_;
  double sum_ = 0;
  int count_ = 0;
};

}  // namespace

std::string LabelOf(const SubjectName& subject) {
  return absl::StrFormat("%s, noise %.2g %%, %d points", subject.shape, subject.noise_percent,
                         subject.points);
}

std::string FormatTable(const std::vector<AccuracyRow>& rows) {
  std::string table = absl::StrCat(kHead, "\n", kRule, "\n");
  for (const AccuracyRow& row : rows) absl::StrAppend(&table, FormatRow(row), "\n");
  return table;
}

absl::StatusOr<std::vector<AccuracyRow>> ReadTable(absl::string_view document) {
  std::vector<AccuracyRow> rows;
  const size_t head = document.find(kHead);
  if (head == absl::string_view::npos) return rows;
  std::vector<absl::string_view> lines = absl::StrSplit(document.substr(head), '\n');
  for (size_t i = 2; i < lines.size() && absl::StartsWith(lines[i], "|"); ++i) {
    RILIEVO_ASSIGN_OR_RETURN(AccuracyRow row, ReadRow(lines[i]));
    rows.push_back(std::move(row));
  }
  return rows;
}

AccuracyComparison CompareTables(const std::vector<AccuracyRow>& before,
                                 const std::vector<AccuracyRow>& after) {
  AccuracyComparison comparison;
  Ratios rms("RMS", &comparison), hausdorff("Hausdorff", &comparison), bytes("bytes", &comparison);
  double log_time = 0;
  for (const AccuracyRow& row : after) {
    const AccuracyRow* const old = Find(before, row.subject);
    if (old == nullptr) continue;
    ++comparison.rows;
    const AccuracyFigures &was = old->figures, &is = row.figures;
    rms.Add(row.subject, was.rms, is.rms);
    hausdorff.Add(row.subject, was.hausdorff, is.hausdorff);
    bytes.Add(row.subject, static_cast<double>(was.bytes), static_cast<double>(is.bytes));
    if (was.microseconds > 0 && is.microseconds > 0) {
      log_time += std::log(is.microseconds / was.microseconds);
    }
    const auto judge = [&](const char* name, double was_share, double is_share) {
      if (is_share <= was_share + kShareTolerance) return;
      comparison.worse.push_back(absl::StrFormat("%s: %s were %.2f %% and are %.2f %%",
                                                 LabelOf(row.subject), name, was_share, is_share));
    };
    judge("wrong normals", was.wrong_normals, is.wrong_normals);
    judge("places of false area", was.false_area, is.false_area);
    if (is.genus != was.genus) {
      comparison.worse.push_back(absl::StrFormat("%s: the genus was %d and is %d",
                                                 LabelOf(row.subject), was.genus, is.genus));
    }
  }
  comparison.rms = rms.Mean();
  comparison.hausdorff = hausdorff.Mean();
  comparison.bytes = bytes.Mean();
  if (comparison.rows > 0) comparison.microseconds = std::exp(log_time / comparison.rows);
  return comparison;
}

}  // namespace rilievo
