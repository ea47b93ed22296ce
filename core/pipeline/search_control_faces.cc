#include "core/pipeline/search_control_faces.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/control/coarser_control_mesh.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/coding_error.h"

namespace rilievo {
namespace {

constexpr double kRatio = 0.4;
constexpr int kFewestFaces = 40;
constexpr int kKeepRounds = 2;
constexpr double kLeastFiner = 0.5;
constexpr double kNone = -1, kHalf = 0.5;  // rungs
constexpr double kAlike = 1.01;            // errors
// Of a control mesh with its header's part, bytes a face: more cannot be had of a size asked for.
constexpr double kBytesPerFace = 1.0;

// What a trial is worth.
struct Worth {
  double own = 0, coding = 0;  // RMS errors
  double from_points = 0;      // RMS distance of the points, noise and strays with it
  double bytes = 0;
};

struct Trial {
  Domain domain;
  CodedRelief relief;
  ReconstructReport report;
  Worth worth;
};

class Search {
 public:
  Search(const ScanSurface& scan, const ControlMesh& start, const DssMetadata& metadata,
         const ReconstructOptions& options, const RunContext& context, ReconstructReport* report)
      : scan_(scan),
        start_(start),
        metadata_(metadata),
        options_(options),
        context_(context),
        report_(report),
        before_(*report) {}

  absl::StatusOr<CodedRelief> Run() {
    const int first = FirstRung();
    RILIEVO_RETURN_IF_ERROR(Try(first));
    int rung = first;
    // Fewer faces while they win, else more.
    while (FacesAt(rung + 1) >= kFewestFaces && best_rung_ == (best_ ? rung : kNone)) {
      RILIEVO_RETURN_IF_ERROR(Try(++rung));
    }
    // What no coarser mesh could keep, a finer one cannot.
    if (best_ && best_rung_ <= first) {
      for (rung = first - 1; rung >= 0 && best_rung_ == rung + 1; --rung) {
        RILIEVO_RETURN_IF_ERROR(Try(rung));
      }
    }
    const double coarse_best = best_rung_;
    for (const double between : {coarse_best + kHalf, coarse_best - kHalf}) {
      if (best_ && between > 0 && FacesAt(between) >= kFewestFaces) {
        RILIEVO_RETURN_IF_ERROR(Try(between));
      }
    }
    if (!best_) return failure_;
    RILIEVO_RETURN_IF_ERROR(KeepError());
    SetReport(best_->report);
    return std::move(best_->relief);
  }

 private:
  int FacesAt(double rung) const {
    return static_cast<int>(static_cast<double>(start_.faces.cols()) * std::pow(kRatio, rung));
  }

  int FirstRung() const {
    int rung = FacesAt(1) >= kFewestFaces ? 1 : 0;
    if (!options_.encode.max_bytes) return rung;
    while (FacesAt(rung + 1) >= kFewestFaces &&
           FacesAt(rung) * kBytesPerFace > static_cast<double>(*options_.encode.max_bytes)) {
      ++rung;
    }
    return rung;
  }

  // With the time spent since.
  void SetReport(const ReconstructReport& report) {
    const ReconstructReport spent = *report_;
    *report_ = report;
    std::copy(std::begin(spent.stage_seconds), std::end(spent.stage_seconds),
              std::begin(report_->stage_seconds));
  }

  absl::Status Try(double rung) {
    SetReport(before_);
    ControlMesh mesh = start_;
    if (rung > 0) {
      RILIEVO_ASSIGN_OR_RETURN(mesh,
                               CoarserControlMesh(scan_.cloud, scan_.index, start_, FacesAt(rung),
                                                  options_.control.creases, context_));
    }
    RILIEVO_ASSIGN_OR_RETURN(const Domain domain,
                             FitDomain(scan_, mesh, options_, context_, report_));
    auto relief = MakeRelief(scan_, domain, metadata_, options_, context_, report_);
    if (absl::IsResourceExhausted(relief.status())) {
      failure_ = relief.status();
      return absl::OkStatus();
    }
    RILIEVO_RETURN_IF_ERROR(relief.status());
    Worth worth{OwnError(*report_, options_.measure), relief->encoded.height_rms,
                report_->error.b_to_a.rms, 0};
    for (const auto& chunk : relief->encoded.chunks) {
      worth.bytes += static_cast<double>(chunk.size());
    }
    if (!best_ || IsBetter(worth, best_->worth)) {
      best_ = Trial{domain, *std::move(relief), *report_, worth};
      best_rung_ = rung;
    }
    return absl::OkStatus();
  }

  // The points tell how far coding has moved the surface away from them in truth: where that is
  // more than the heights' own error foretold, they are coded again more finely.
  absl::Status KeepError() {
    if (!options_.encode.max_error || !options_.measure) return absl::OkStatus();
    const double limit = *options_.encode.max_error;
    double asked = limit;
    SetReport(best_->report);
    for (int round = 0; round < kKeepRounds; ++round) {
      if (best_->report.error_unreachable) return absl::OkStatus();
      RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded,
                               DecodeDss(best_->relief.encoded.Concatenate(), context_));
      RILIEVO_ASSIGN_OR_RETURN(const TwoSidedError coded,
                               MeasureSurface(decoded.surface, scan_.cloud.points, context_));
      const Worth& worth = best_->worth;
      const double added =
          coded.b_to_a.rms * coded.b_to_a.rms - worth.from_points * worth.from_points;
      const double error = std::sqrt(worth.own * worth.own + std::max(0.0, added));
      if (error <= limit) return absl::OkStatus();
      asked *= std::max(kLeastFiner, 0.98 * limit / error);
      ReconstructOptions finer = options_;
      finer.encode.max_error = asked;
      RILIEVO_ASSIGN_OR_RETURN(
          best_->relief, MakeRelief(scan_, best_->domain, metadata_, finer, context_, report_));
      best_->report = *report_;
      best_->report.error_unreachable = false;  // of the error asked for, not of the finer one
    }
    return absl::OkStatus();
  }

  // Parts of the scan that one trial has and the other lost stand out of what both have of noise.
  static double Error(const Worth& worth, const Worth& other) {
    const double least = std::min(worth.from_points, other.from_points);
    const double lost = worth.from_points * worth.from_points - least * least;
    return std::sqrt(std::max(worth.own * worth.own, lost) + worth.coding * worth.coding);
  }

  bool IsBetter(const Worth& worth, const Worth& other) const {
    const double error = Error(worth, other), other_error = Error(other, worth);
    if (options_.encode.max_bytes) return error < other_error;
    const double limit = *options_.encode.max_error;
    if (error <= limit && other_error <= limit) return worth.bytes < other.bytes;
    if (error > limit && other_error > limit && worth.own > limit && other.own > limit) {
      // Neither can: the default coding is used, and a little error buys no bytes.
      const bool alike = error < kAlike * other_error && other_error < kAlike * error;
      return alike ? worth.bytes < other.bytes : error < other_error;
    }
    return error < other_error;
  }

  const ScanSurface& scan_;
  const ControlMesh& start_;
  const DssMetadata& metadata_;
  const ReconstructOptions& options_;
  const RunContext& context_;
  ReconstructReport* report_;
  const ReconstructReport before_;  // the first trial
  std::optional<Trial> best_;
  double best_rung_ = kNone;
  absl::Status failure_;
};

}  // namespace

absl::StatusOr<CodedRelief> SearchControlFaces(const ScanSurface& scan, const ControlMesh& start,
                                               const DssMetadata& metadata,
                                               const ReconstructOptions& options,
                                               const RunContext& context,
                                               ReconstructReport* report) {
  return Search(scan, start, metadata, options, context, report).Run();
}

}  // namespace rilievo
