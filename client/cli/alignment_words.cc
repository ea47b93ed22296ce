#include "client/cli/alignment_words.h"

#include <algorithm>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/length_words.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;

std::string Both(const AlignmentReport& report, double length) {
  return absl::StrCat(LengthText(length, report.place), " (",
                      Percent(length / report.alignment.diagonal), ")");
}

std::string PairName(const AlignmentReport& report, const PairFigures& pair) {
  return absl::StrCat(report.scans[pair.first], " and ", report.scans[pair.second]);
}

Json MoveJson(const Eigen::Isometry3d& move) {
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) {
    rows.push_back({move.matrix()(row, 0), move.matrix()(row, 1), move.matrix()(row, 2),
                    move.matrix()(row, 3)});
  }
  return rows;
}

absl::Status NotConnected(const AlignmentReport& report) {
  const Alignment& alignment = report.alignment;
  std::vector<std::string> with_first, others;
  for (size_t i = 0; i < report.scans.size(); ++i) {
    (alignment.group[i] == 0 ? with_first : others).push_back(report.scans[i]);
  }
  const PairFigures* most = nullptr;  // among those that would connect
  for (const PairFigures& pair : alignment.pairs) {
    if ((alignment.group[pair.first] == 0) == (alignment.group[pair.second] == 0)) continue;
    if (most == nullptr || pair.overlap > most->overlap) most = &pair;
  }
  return absl::FailedPreconditionError(absl::StrCat(
      absl::StrJoin(others, ", "), " and ", absl::StrJoin(with_first, ", "),
      " do not overlap enough: ",
      most == nullptr
          ? std::string("they have no place of the surface in common")
          : absl::StrCat("at most ", Percent(most->overlap), " of the points of one lie on the ",
                         "surface of another (", PairName(report, *most), "), where ",
                         Percent(AlignmentOptions{}.least_overlap), " are needed"),
      "; give a scan that overlaps both, or bring them nearer to where they belong, "
      "within 5 degrees and 3 % of the diagonal"));
}

absl::Status NotFitting(const AlignmentReport& report, const PairFigures& pair) {
  const std::string figures =
      absl::StrCat(Percent(pair.overlap), " overlap, RMS ", Both(report, pair.rms),
                   " where noise and spacing explain ", Both(report, pair.explained));
  if (pair.fits_alone) {
    return absl::FailedPreconditionError(absl::StrCat(
        PairName(report, pair), " fit alone, but not together with the others (", figures,
        "): the loop of scans does not close; look for one that is bent, has another scale or "
        "shows something that moved, and leave it out"));
  }
  return absl::FailedPreconditionError(absl::StrCat(
      PairName(report, pair), " do not fit (", figures,
      "): they do not show the same rigid surface, or start too far apart; bring them nearer to "
      "where they belong, within 5 degrees and 3 % of the diagonal, or leave one out"));
}

}  // namespace

std::string AlignmentText(const AlignmentReport& report) {
  std::string text;
  for (const PairFigures& pair : report.alignment.pairs) {
    const std::string verdict = pair.fits       ? ""
                                : pair.overlaps ? "; does not fit"
                                                : "; too little to count";
    absl::StrAppend(
        &text,
        Wrap(absl::StrCat(PairName(report, pair), ": ", Percent(pair.overlap), " overlap, ",
                          Counted(pair.matches, "pair", "pairs"), " of points, RMS ",
                          Both(report, pair.rms), ", explained by noise and spacing ",
                          Both(report, pair.explained), verdict),
             2),
        "\n");
  }
  return text;
}

std::string AlignedLine(const AlignmentReport& report) {
  int64_t overlapping = 0;
  const PairFigures* worst = nullptr;
  for (const PairFigures& pair : report.alignment.pairs) {
    if (!pair.overlaps) continue;
    ++overlapping;
    if (worst == nullptr || pair.rms > worst->rms) worst = &pair;
  }
  std::string line =
      absl::StrCat(Counted(static_cast<int64_t>(report.scans.size()), "scan", "scans"), ", ",
                   Counted(overlapping, "pair overlaps", "pairs overlap"));
  if (worst != nullptr) {
    absl::StrAppend(&line, ", RMS at most ", Both(report, worst->rms), " (",
                    PairName(report, *worst), "), of which noise and spacing explain ",
                    Both(report, worst->explained));
  }
  return line;
}

Json AlignmentJson(const AlignmentReport& report) {
  const Alignment& alignment = report.alignment;
  const std::string unit = UnitName(report.place.metres_per_unit);
  Json json = {{"aligned", alignment.IsSound()},
               {"rounds", alignment.rounds},
               {"converged", alignment.converged},
               {"diagonal", alignment.diagonal},
               {"unit", unit.empty() ? Json() : Json(unit)},
               {"scans", Json::array()},
               {"pairs", Json::array()}};
  for (size_t i = 0; i < report.scans.size(); ++i) {
    const Eigen::AngleAxisd turn(alignment.moves[i].linear());
    json["scans"].push_back({{"scan", report.scans[i]},
                             {"move", MoveJson(alignment.moves[i])},
                             {"turn_degrees", turn.angle() * 180 / std::numbers::pi}});
  }
  for (const PairFigures& pair : alignment.pairs) {
    json["pairs"].push_back({{"first", report.scans[pair.first]},
                             {"second", report.scans[pair.second]},
                             {"overlap", pair.overlap},
                             {"matches", pair.matches},
                             {"rms", pair.rms},
                             {"rms_ratio", pair.rms / alignment.diagonal},
                             {"spread", pair.spread},
                             {"explained", pair.explained},
                             {"overlaps", pair.overlaps},
                             {"fits", pair.fits}});
  }
  return json;
}

absl::Status CheckAlignment(const AlignmentReport& report) {
  if (report.alignment.IsSound()) return absl::OkStatus();
  // The pair that is worst of those that do not fit, those first that do not even alone.
  const PairFigures* worst = nullptr;
  const auto excess = [](const PairFigures& pair) {
    return pair.spread / pair.explained + (pair.fits_alone ? 0 : 1e6);
  };
  for (const PairFigures& pair : report.alignment.pairs) {
    if (!pair.overlaps || pair.fits) continue;
    if (worst == nullptr || excess(pair) > excess(*worst)) worst = &pair;
  }
  return worst != nullptr ? NotFitting(report, *worst) : NotConnected(report);
}

}  // namespace rilievo
