#include "core/pipeline/search_control_faces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

constexpr double kNone = -2, kGivenMesh = -1, kHalf = 0.5;  // steps

// What a trial costs.
struct Cost {
  double own = 0, coding = 0;  // RMS errors
  double from_points = 0;      // RMS distance of the points, noise and outliers with it
  double bytes = 0;
  double kept = -1;  // of the error to be kept, as the certificate measures it: before coding
};

struct Trial {
  Domain domain;  // before it was cut
  CodedSurface coded;
  Cost cost;
};

class Search {
 public:
  Search(const ScanSurface& scan, const Shape& mesh, const ControlMeshResult& start,
         const DssMetadata& metadata, const ReconstructOptions& options,
         const PipelineContext& context)
      : scan_(scan),
        mesh_(mesh),
        start_(start.mesh),
        topology_(start.topology),
        metadata_(metadata),
        options_(options),
        context_(context) {}

  absl::StatusOr<CodedSurface> Run() {
    const int first = FirstRung();
    RILIEVO_RETURN_IF_ERROR(Try(first));
    int step = first;
    // Fewer faces while they win, else more.
    while (FacesAt(step + 1) >= kSearchControlFaces.fewest_faces &&
           best_step_ == (best_ ? step : kNone)) {
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
    if (IsMachined(start_)) RILIEVO_RETURN_IF_ERROR(TryBeside(kHalf / 2));
    if (const auto given = DomainOfMesh(scan_, mesh_, start_.faces.cols(), options_)) {
      RILIEVO_RETURN_IF_ERROR(TryDomain(*given, kGivenMesh, options_));
    }
    if (!best_) return failure_;
    if (options_.encode.position_step == 0) RILIEVO_RETURN_IF_ERROR(TrySteps());
    RILIEVO_RETURN_IF_ERROR(Keep());
    return std::move(best_->coded);
  }

 private:
  int FacesAt(double step) const {
    return static_cast<int>(static_cast<double>(start_.faces.cols()) *
                            std::pow(kSearchControlFaces.ratio, step));
  }

  int FirstRung() const {
    int step = FacesAt(1) >= kSearchControlFaces.fewest_faces ? 1 : 0;
    if (!options_.encode.max_bytes) return step;
    // A control mesh with its header takes a byte a face at least.
    while (FacesAt(step + 1) >= kSearchControlFaces.fewest_faces &&
           FacesAt(step) > *options_.encode.max_bytes)
      ++step;
    return step;
  }

  // Part of a step to either side of the best one.
  absl::Status TryBeside(double part) {
    const double middle = best_step_;
    for (const double between : {middle + part, middle - part}) {
      if (best_ && between > 0 && FacesAt(between) >= kSearchControlFaces.fewest_faces) {
        RILIEVO_RETURN_IF_ERROR(Try(between));
      }
    }
    return absl::OkStatus();
  }

  absl::Status Try(double step) {
    ControlMesh mesh = start_;
    if (step > 0) {
      RILIEVO_ASSIGN_OR_RETURN(mesh, FewerFaces(scan_, start_, FacesAt(step), context_));
    }
    RILIEVO_ASSIGN_OR_RETURN(const Domain domain, FitDomain(scan_, mesh, options_, context_));
    return TryDomain(domain, step, options_);
  }

  // Coarser steps of the control points while they win, else one finer: what they save, heights
  // may have to make good.
  absl::Status TrySteps() {
    const double first = best_->domain.position_step;
    const double coarsest = best_->domain.is_filled ? kFitDomain.step_where_filled : kMaxStep;
    ReconstructOptions options = options_;
    for (const double ratio :
         {kSearchControlFaces.step_ratio, 1 / kSearchControlFaces.step_ratio}) {
      for (double step = first * ratio; step <= coarsest; step *= ratio) {
        Domain domain = best_->domain;
        domain.position_step = step;
        options.encode.position_step = step;  // for a domain that is cut and fitted again
        RILIEVO_RETURN_IF_ERROR(TryDomain(domain, best_step_, options));
        if (best_->domain.position_step != step) break;
      }
      if (best_->domain.position_step != first) break;
    }
    return absl::OkStatus();
  }

  absl::StatusOr<CodedSurface> SampleAndCode(const Domain& domain,
                                             const ReconstructOptions& options) const {
    RILIEVO_ASSIGN_OR_RETURN(SampledSurface sampled,
                             SampleHeights(scan_, topology_, domain, options, context_));
    return CodeSurface(scan_.cloud, mesh_, std::move(sampled), metadata_, options, context_);
  }

  absl::Status TryDomain(const Domain& domain, double step, const ReconstructOptions& options) {
    auto coded = SampleAndCode(domain, options);
    if (absl::IsResourceExhausted(coded.status())) {
      failure_ = coded.status();
      return absl::OkStatus();
    }
    RILIEVO_RETURN_IF_ERROR(coded.status());
    const UncodedError& uncoded = coded->uncoded;
    const Cost cost{OwnError(uncoded), coded->encoded.height_rms, uncoded.error.b_to_a.rms,
                    static_cast<double>(BytesOf(coded->encoded)), uncoded.error.across_rms};
    kept_of_step_[step] = cost.kept;
    if (!best_ || IsBetter(cost, best_->cost)) {
      best_ = Trial{domain, *std::move(coded), cost};
      best_step_ = step;
    }
    return absl::OkStatus();
  }

  // The best trial coded so that the error asked for is kept in truth; where it cannot be, one of
  // more faces that can, or else the most exact of these, unless noise alone is more than that.
  absl::Status Keep() {
    RILIEVO_RETURN_IF_ERROR(KeepBest());
    if (best_->coded.keeps_error || !NoiseAllows(*options_.encode.max_error, Noise())) {
      return absl::OkStatus();
    }
    Trial nearest = *best_;
    double step_of_nearest = best_step_;
    for (int step = static_cast<int>(std::ceil(step_of_nearest)) - 1; step >= 0; --step) {
      const auto tried = kept_of_step_.find(step);
      if (tried != kept_of_step_.end() && tried->second >= *options_.encode.max_error) continue;
      best_.reset();
      RILIEVO_RETURN_IF_ERROR(Try(step));
      if (!best_) continue;
      RILIEVO_RETURN_IF_ERROR(KeepBest());
      if (best_->coded.keeps_error) return absl::OkStatus();
      if (Reached(best_->cost) < Reached(nearest.cost)) {
        nearest = *std::move(best_);
        step_of_nearest = step;
      }
    }
    best_ = std::move(nearest);
    best_step_ = step_of_nearest;
    return absl::OkStatus();
  }

  absl::Status KeepBest() {
    RILIEVO_ASSIGN_OR_RETURN(
        best_->coded, KeepError(scan_.cloud, mesh_, std::move(best_->coded), options_, context_));
    return absl::OkStatus();
  }

  // Of the error to be kept; 1 and more where that was not measured.
  static double Reached(const Cost& cost) { return std::hypot(cost.kept, cost.coding); }

  double Noise() const { return scan_.cloud.median_noise; }

  bool Keeps(const Cost& cost) const {
    const double limit = *options_.encode.max_error;
    return cost.kept >= 0 && NoiseAllows(limit, Noise()) && Reached(cost) <= limit;
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
      const bool alike = error < kSearchControlFaces.alike * other_error &&
                         other_error < kSearchControlFaces.alike * error;
      return alike ? cost.bytes < other.bytes : error < other_error;
    }
    return error < other_error;
  }

  const ScanSurface& scan_;
  const Shape& mesh_;  // the given one
  const ControlMesh& start_;
  const Topology topology_;
  const DssMetadata& metadata_;
  const ReconstructOptions& options_;
  const PipelineContext& context_;
  std::optional<Trial> best_;
  double best_step_ = kNone;
  std::map<double, double> kept_of_step_;  // Cost::kept
  absl::Status failure_;
};

}  // namespace

absl::StatusOr<CodedSurface> SearchControlFaces(const ScanSurface& scan, const Shape& mesh,
                                                const ControlMeshResult& start,
                                                const DssMetadata& metadata,
                                                const ReconstructOptions& options,
                                                const PipelineContext& context) {
  return Search(scan, mesh, start, metadata, options, context).Run();
}

}  // namespace rilievo
