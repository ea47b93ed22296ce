#include "tests/accuracy/ablation_table.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/ablation.h"
#include "core/base/status_macros.h"
#include "tests/accuracy/settings_by_name.h"

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

absl::Status CannotChange() {
  return absl::FailedPreconditionError(
      "this build can change nothing: configure with -DRILIEVO_ABLATION=ON");
}

absl::Status Leave(Mechanism mechanism, bool out) {
#ifdef RILIEVO_ABLATION
  LeaveOut(mechanism, out);
  return absl::OkStatus();
#else
  static_cast<void>(mechanism);
  static_cast<void>(out);
  return CannotChange();
#endif
}

// What is made otherwise for one row of the table, and how it is undone.
struct Change {
  std::string name;
  std::function<absl::Status()> make, undo;
};

absl::StatusOr<std::string> MeasureChanges(const std::vector<SubjectName>& subjects,
                                           const std::vector<Change>& changes, int seeds) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<AccuracyRow> before, MeasureAll(subjects, seeds));
  std::string table = kAblationHead;
  std::cout << table << std::flush;
  for (const Change& change : changes) {
    RILIEVO_RETURN_IF_ERROR(change.make());
    const absl::StatusOr<std::vector<AccuracyRow>> after = MeasureAll(subjects, seeds);
    RILIEVO_RETURN_IF_ERROR(change.undo());
    const std::string row =
        after.ok() ? AblationRow(change.name, before, *after)
                   : absl::StrCat("| `", change.name, "` | ", after.status().message(), " |\n");
    std::cout << row << std::flush;
    table += row;
  }
  return table;
}

}  // namespace

#ifndef RILIEVO_ABLATION
std::vector<NamedSetting> AllSettings() { return {}; }
#endif

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
  std::vector<Change> changes;
  for (const NamedMechanism& named : mechanisms) {
    changes.push_back({std::string(named.name), [=] { return Leave(named.mechanism, true); },
                       [=] { return Leave(named.mechanism, false); }});
  }
  return MeasureChanges(subjects, changes, seeds);
}

absl::Status SetByName(std::string_view name, double value) {
  const std::vector<NamedSetting> settings = AllSettings();
  if (settings.empty()) return CannotChange();
  for (const NamedSetting& setting : settings) {
    if (setting.name != name) continue;
    if (setting.whole && value != std::round(value)) {
      return absl::InvalidArgumentError(
          absl::StrCat(std::string(name), " is a count, and ", value, " is none"));
    }
    setting.set(value);
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("no setting is called '", std::string(name),
                                                 "'; they stand in the settings.h of each room"));
}

std::vector<double> OtherValues(double value, bool whole) {
  if (whole) {
    return {std::min(value - 1, std::round(0.7 * value)),
            std::max(value + 1, std::round(1.4 * value))};
  }
  if (value > 0.5 && value < 1) return {1 - 1.4 * (1 - value), 1 - 0.7 * (1 - value)};
  return {0.7 * value, 1.4 * value};
}

absl::StatusOr<std::string> MeasureSensitivity(const std::vector<SubjectName>& subjects,
                                               const std::vector<std::string>& names, int seeds) {
  std::vector<Change> changes;
  for (const NamedSetting& setting : AllSettings()) {
    const bool wanted = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      return setting.name.starts_with(name);
    });
    if (!names.empty() && !wanted) continue;
    const double usual = setting.value();
    const auto set = [=](double value) {
      setting.set(value);
      return absl::OkStatus();
    };
    for (const double value : OtherValues(usual, setting.whole)) {
      changes.push_back({absl::StrFormat("%s %g -> %g", std::string(setting.name), usual, value),
                         [=] { return set(value); }, [=] { return set(usual); }});
    }
  }
  if (AllSettings().empty()) return CannotChange();
  if (changes.empty()) {
    return absl::InvalidArgumentError(
        "no setting has such a name; they stand in the settings.h of each room");
  }
  return MeasureChanges(subjects, changes, seeds);
}

}  // namespace rilievo
