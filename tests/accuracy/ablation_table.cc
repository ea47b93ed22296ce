#include "tests/accuracy/ablation_table.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/ablation.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr char kAblationHead[] =
    "| without | RMS | its worst row | Hausdorff | its worst row | other genus | wrong normals | "
    "false area | bytes | time |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";

// One figure without the mechanism over the same with it: the geometric mean and the row that loses
// most.
class Loss {
 public:
  void Add(const SubjectName& subject, double with, double without) {
    if (!(with > 0) || !(without > 0)) return;
    const double ratio = std::log(without / with);
    sum_ += ratio;
    ++count_;
    if (count_ > 1 && ratio <= most_) return;
    most_ = ratio;
    worst_ = subject;
  }
  double Mean() const { return count_ > 0 ? std::exp(sum_ / count_) : 1; }
  std::string Worst() const {
    return absl::StrFormat("%.3f %s %.2g %%", std::exp(most_), worst_.shape, worst_.noise_percent);
  }

 private:
  double sum_ = 0, most_ = 0;
  int count_ = 0;
  SubjectName worst_;
};

std::string AblationRow(std::string_view name, const std::vector<AccuracyRow>& with,
                        const std::vector<AccuracyRow>& without) {
  Loss rms, hausdorff, bytes, time;
  int other_genus = 0;
  double wrong_normals = 0, false_area = 0;
  for (size_t i = 0; i < with.size(); ++i) {
    const AccuracyFigures &a = with[i].figures, &b = without[i].figures;
    rms.Add(with[i].subject, a.rms, b.rms);
    hausdorff.Add(with[i].subject, a.hausdorff, b.hausdorff);
    bytes.Add(with[i].subject, static_cast<double>(a.bytes), static_cast<double>(b.bytes));
    time.Add(with[i].subject, a.microseconds, b.microseconds);
    other_genus += a.genus != b.genus;
    wrong_normals = std::max(wrong_normals, b.wrong_normals - a.wrong_normals);
    false_area = std::max(false_area, b.false_area - a.false_area);
  }
  return absl::StrFormat("| `%s` | %.4f | %s | %.4f | %s | %d | +%.2f | +%.2f | %.3f | %.3f |\n",
                         absl::string_view(name.data(), name.size()), rms.Mean(), rms.Worst(),
                         hausdorff.Mean(), hausdorff.Worst(), other_genus, wrong_normals,
                         false_area, bytes.Mean(), time.Mean());
}

absl::StatusOr<std::vector<AccuracyRow>> MeasureAll(const std::vector<SubjectName>& names,
                                                    int seeds) {
  std::vector<AccuracyRow> rows;
  for (const SubjectName& name : names) {
    RILIEVO_ASSIGN_OR_RETURN(const AccuracyFigures figures,
                             MeasureAccuracy(name, seeds, RunContext{}));
    rows.push_back({name, figures});
  }
  return rows;
}

absl::StatusOr<Mechanism> MechanismOf(std::string_view name) {
  for (const NamedMechanism& known : kMechanisms) {
    if (known.name == name) return known.mechanism;
  }
  return absl::InvalidArgumentError(absl::StrCat("no mechanism is called '",
                                                 absl::string_view(name.data(), name.size()),
                                                 "'; all: ", "core/base/ablation.h"));
}

absl::Status Leave(Mechanism mechanism, bool out) {
#ifdef RILIEVO_ABLATION
  LeaveOut(mechanism, out);
  return absl::OkStatus();
#else
  static_cast<void>(mechanism);
  static_cast<void>(out);
  return absl::FailedPreconditionError(
      "this build can leave nothing out: configure with -DRILIEVO_ABLATION=ON");
#endif
}

}  // namespace

absl::Status LeaveOutByName(std::string_view name) {
  RILIEVO_ASSIGN_OR_RETURN(const Mechanism mechanism, MechanismOf(name));
  return Leave(mechanism, true);
}

absl::StatusOr<std::string> MeasureAblation(const std::vector<SubjectName>& subjects,
                                            const std::vector<std::string>& names, int seeds) {
  std::vector<NamedMechanism> mechanisms;
  for (const std::string& name : names) {
    RILIEVO_ASSIGN_OR_RETURN(const Mechanism mechanism, MechanismOf(name));
    mechanisms.push_back({mechanism, name});
  }
  if (names.empty()) mechanisms.assign(kMechanisms.begin(), kMechanisms.end());
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<AccuracyRow> with, MeasureAll(subjects, seeds));
  std::string table = kAblationHead;
  std::cout << table << std::flush;
  for (const NamedMechanism& mechanism : mechanisms) {
    RILIEVO_RETURN_IF_ERROR(Leave(mechanism.mechanism, true));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<AccuracyRow> without, MeasureAll(subjects, seeds));
    RILIEVO_RETURN_IF_ERROR(Leave(mechanism.mechanism, false));
    const std::string row = AblationRow(mechanism.name, with, without);
    std::cout << row << std::flush;
    table += row;
  }
  return table;
}

}  // namespace rilievo
