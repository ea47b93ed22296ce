// The table of docs/accuracy.md: written, read back, compared.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "tests/accuracy/measure_accuracy.h"
#include "tests/accuracy/subject.h"

namespace rilievo {

struct AccuracyRow {
  SubjectName subject;
  AccuracyFigures figures;
};

// The scan in words; no two have the same.
std::string LabelOf(const SubjectName& subject);

// Markdown, one line per row, figures to four digits.
std::string FormatTable(const std::vector<AccuracyRow>& rows);

// The rows of the first such table in a document. INVALID_ARGUMENT, naming the line, for a line of
// it that is not a row.
absl::StatusOr<std::vector<AccuracyRow>> ReadTable(absl::string_view document);

struct AccuracyComparison {
  // New over old, geometric means over the rows that both tables have.
  double rms = 1, hausdorff = 1, bytes = 1, microseconds = 1;
  int rows = 0;
  // One sentence for each row that is worse by more than 3 % in RMS, Hausdorff distance or bytes,
  // whose genus is another one, or that has more wrong normals or false area; and for each
  // geometric mean that is worse by more than 1 %. Times vary between machines and are not judged.
  std::vector<std::string> worse;
};

AccuracyComparison CompareTables(const std::vector<AccuracyRow>& before,
                                 const std::vector<AccuracyRow>& after);

}  // namespace rilievo
