#include "core/pipeline/search_control_faces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/coding_error.h"
#include "core/pipeline/domain_resolution.h"
#include "core/pipeline/keep_error.h"
#include "core/pipeline/position_step.h"

namespace rilievo {
namespace {

constexpr double kRatio = 0.4;
constexpr int kFewestFaces = 40;
constexpr double kNone = -1, kHalf = 0.5, kQuarter = 0.25;  // steps
constexpr double kStepRatio = 1.5;                          // of position steps
constexpr double kAlike = 1.01;                             // errors
constexpr double kCoarsestStep = 0.01;                      // EncodeOptions::position_step
// Of a control mesh with its header's part, bytes a face: more cannot be had of a size asked for.
constexpr double kBytesPerFace = 1.0;

// What a trial costs.
struct Cost {
  double own = 0, coding = 0;  // RMS errors
  double from_points = 0;      // RMS distance of the points, noise and strays with it
  double bytes = 0;
  double kept = -1;  // of the error to be kept, as the certificate measures it: before coding
};

struct Trial {
  Domain domain;
  CodedSurface coded;
  ReconstructReport report;
  Cost cost;
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

  absl::StatusOr<CodedSurface> Run() {
    const int first = FirstRung();
    RILIEVO_RETURN_IF_ERROR(Try(first));
    int step = first;
    // Fewer faces while they win, else more.
    while (FacesAt(step + 1) >= kFewestFaces && best_step_ == (best_ ? step : kNone)) {
      RILIEVO_RETURN_IF_ERROR(Try(++step));
    }
    // What no coarser mesh could keep, a finer one cannot.
    if (best_ && best_step_ <= first) {
      for (step = first - 1; step >= 0 && best_step_ == step + 1; --step) {
        RILIEVO_RETURN_IF_ERROR(Try(step));
      }
    }
    RILIEVO_RETURN_IF_ERROR(TryBeside(kHalf));
    // Of a part with sharp edges the error hangs on where the few control points happen to lie, so
    // more meshes are worth a try.
    if (IsMachined(start_)) RILIEVO_RETURN_IF_ERROR(TryBeside(kQuarter));
    if (!best_) return failure_;
    if (options_.encode.position_step == 0) RILIEVO_RETURN_IF_ERROR(TrySteps());
    RILIEVO_RETURN_IF_ERROR(Keep());
    SetReport(best_->report);
    return std::move(best_->coded);
  }

 private:
  int FacesAt(double step) const {
    return static_cast<int>(static_cast<double>(start_.faces.cols()) * std::pow(kRatio, step));
  }

  int FirstRung() const {
    int step = FacesAt(1) >= kFewestFaces ? 1 : 0;
    if (!options_.encode.max_bytes) return step;
    while (FacesAt(step + 1) >= kFewestFaces &&
           FacesAt(step) * kBytesPerFace > static_cast<double>(*options_.encode.max_bytes)) {
      ++step;
    }
    return step;
  }

  // With the time spent since.
  void SetReport(const ReconstructReport& report) {
    const ReconstructReport spent = *report_;
    *report_ = report;
    std::copy(std::begin(spent.stage_seconds), std::end(spent.stage_seconds),
              std::begin(report_->stage_seconds));
  }

  // Part of a step to either side of the best one.
  absl::Status TryBeside(double part) {
    const double middle = best_step_;
    for (const double between : {middle + part, middle - part}) {
      if (best_ && between > 0 && FacesAt(between) >= kFewestFaces) {
        RILIEVO_RETURN_IF_ERROR(Try(between));
      }
    }
    return absl::OkStatus();
  }

  absl::Status Try(double step) {
    SetReport(before_);
    ControlMesh mesh = start_;
    if (step > 0) {
      RILIEVO_ASSIGN_OR_RETURN(mesh, FewerFaces(scan_, start_, FacesAt(step), context_));
    }
    RILIEVO_ASSIGN_OR_RETURN(const Domain domain,
                             FitDomain(scan_, mesh, options_, context_, report_));
    return TryDomain(domain, step, options_);
  }

  // Coarser steps of the control points while they win, else one finer: what they save, heights
  // may have to make good.
  absl::Status TrySteps() {
    const double first = best_->domain.position_step;
    ReconstructOptions options = options_;
    for (const double ratio : {kStepRatio, 1 / kStepRatio}) {
      for (double step = first * ratio; step <= kCoarsestStep; step *= ratio) {
        SetReport(best_->report);
        RILIEVO_ASSIGN_OR_RETURN(const Domain domain, RoundDomain(best_->domain.fitted, step));
        // A domain that is cut is fitted again.
        options.encode.position_step = step;
        RILIEVO_RETURN_IF_ERROR(TryDomain(domain, best_step_, options));
        if (best_->domain.position_step != step) break;
      }
      if (best_->domain.position_step != first) break;
    }
    return absl::OkStatus();
  }

  absl::Status TryDomain(const Domain& domain, double step, const ReconstructOptions& options) {
    auto coded = BuildSurface(scan_, domain, metadata_, options, context_, report_);
    if (absl::IsResourceExhausted(coded.status())) {
      failure_ = coded.status();
      return absl::OkStatus();
    }
    RILIEVO_RETURN_IF_ERROR(coded.status());
    Cost cost{OwnError(*report_, options_.measure), coded->encoded.height_rms,
              report_->error.b_to_a.rms, 0, report_->error.across_rms};
    for (const auto& chunk : coded->encoded.chunks) {
      cost.bytes += static_cast<double>(chunk.size());
    }
    kept_of_step_[step] = cost.kept;
    if (!best_ || IsBetter(cost, best_->cost)) {
      best_ = Trial{domain, *std::move(coded), *report_, cost};
      best_step_ = step;
    }
    return absl::OkStatus();
  }

  // The best trial coded so that the error asked for is kept in truth; where it cannot be, one of
  // more faces that can, unless noise alone is more than that.
  absl::Status Keep() {
    RILIEVO_ASSIGN_OR_RETURN(bool kept, KeepBest());
    if (kept || !NoiseAllows(*options_.encode.max_error, *report_)) return absl::OkStatus();
    const Trial nearest = *best_;
    const double step_of_nearest = best_step_;
    for (int step = static_cast<int>(std::ceil(step_of_nearest)) - 1; step >= 0; --step) {
      const auto tried = kept_of_step_.find(step);
      if (tried != kept_of_step_.end() && tried->second >= *options_.encode.max_error) continue;
      best_.reset();
      RILIEVO_RETURN_IF_ERROR(Try(step));
      if (!best_) continue;
      RILIEVO_ASSIGN_OR_RETURN(kept, KeepBest());
      if (kept) return absl::OkStatus();
    }
    best_ = nearest;
    best_step_ = step_of_nearest;
    return absl::OkStatus();
  }

  absl::StatusOr<bool> KeepBest() {
    SetReport(best_->report);
    RILIEVO_ASSIGN_OR_RETURN(const bool kept,
                             KeepError(scan_.cloud, options_, context_, report_, &best_->coded));
    best_->report = *report_;
    return kept;
  }

  bool Keeps(const Cost& cost) const {
    const double limit = *options_.encode.max_error;
    return cost.kept >= 0 && NoiseAllows(limit, before_) &&
           std::hypot(cost.kept, cost.coding) <= limit;
  }

  // Parts of the scan that one trial has and the other lost stand out of what both have of noise.
  static double Error(const Cost& cost, const Cost& other) {
    const double least = std::min(cost.from_points, other.from_points);
    const double lost = cost.from_points * cost.from_points - least * least;
    return std::sqrt(std::max(cost.own * cost.own, lost) + cost.coding * cost.coding);
  }

  bool IsBetter(const Cost& cost, const Cost& other) const {
    const double error = Error(cost, other), other_error = Error(other, cost);
    if (options_.encode.max_bytes) return error < other_error;
    if (Keeps(cost) != Keeps(other)) return Keeps(cost);
    if (Keeps(cost)) return cost.bytes < other.bytes;
    const double limit = *options_.encode.max_error;
    if (error <= limit && other_error <= limit) return cost.bytes < other.bytes;
    if (error > limit && other_error > limit && cost.own > limit && other.own > limit) {
      // Neither can: the default coding is used, and a little error buys no bytes.
      const bool alike = error < kAlike * other_error && other_error < kAlike * error;
      return alike ? cost.bytes < other.bytes : error < other_error;
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
  double best_step_ = kNone;
  std::map<double, double> kept_of_step_;  // Cost::kept
  absl::Status failure_;
};

}  // namespace

absl::StatusOr<CodedSurface> SearchControlFaces(const ScanSurface& scan, const ControlMesh& start,
                                                const DssMetadata& metadata,
                                                const ReconstructOptions& options,
                                                const RunContext& context,
                                                ReconstructReport* report) {
  return Search(scan, start, metadata, options, context, report).Run();
}

}  // namespace rilievo
