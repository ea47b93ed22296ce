#include "core/pipeline/code_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

// `to_keep`: as the certificate will state it.
absl::StatusOr<TwoSidedError> Measure(const OrientedCloud& cloud, const Shape& mesh,
                                      const Shape& shape, bool to_keep,
                                      const PipelineContext& context) {
  const StageScope scope(Stage::kMeasure, context);
  if (to_keep) return MeasureTriangles(shape, ShapeToMeasure(cloud, mesh), context);
  TwoSidedError error;
  RILIEVO_ASSIGN_OR_RETURN(error.b_to_a,
                           MeasureOneSided({SomePoints(cloud.points), {}}, shape, {}, context));
  return error;
}

// `coding_error`: of the heights; unset where the options ask for a step or for bytes.
absl::StatusOr<EncodedSurface> Encode(const CodedSurface& coded, std::optional<double> coding_error,
                                      const ReconstructOptions& options,
                                      const PipelineContext& context) {
  const StageScope scope(Stage::kEncode, context);
  EncodeOptions encode = options.encode;
  encode.position_step = coded.domain.position_step;
  encode.border_digits = BorderDigitsOf(coded.domain);
  encode.max_error = coding_error;
  encode.keep_zero_border = coded.domain.has_exact_border;
  const DisplacedSurface& surface = coded.surface;
  const int64_t faces = surface.control_mesh.faces.cols() << (2 * surface.max_level);
  return EncodeDss(surface, WithWidestFigures(coded.metadata, options.measure, faces), encode,
                   context);
}

double Squared(double x) { return x * x; }

// Search over the RMS error that the heights are coded with. What coding adds to the mean square
// of the surface is about in proportion to the mean square of the heights' error.
class KeepSearch {
 public:
  KeepSearch(double limit, double own) : limit_(limit), own_(own) {}

  // The next coding error after `error` was measured with `coding`; 0 when the search is over.
  double Next(double coding, double error) {
    (error <= limit_ ? low_ : high_) = coding;
    if (error <= limit_ && error >= kCodeSurface.close * limit_) return 0;
    if (low_ > 0 && high_ > 0 && kCodeSurface.keep_aim * high_ < low_) return 0;
    const double aim = kCodeSurface.keep_aim * limit_;
    const double room = aim > own_ ? Squared(aim) - Squared(own_) : 0;
    // At least a quarter of the room that there is at all.
    const double wanted = std::max(room, 0.25 * (Squared(limit_) - Squared(own_)));
    const double added = Squared(error) - Squared(own_);
    const double factor = added > 0
                              ? std::clamp(std::sqrt(wanted / added), kCodeSurface.least_factor,
                                           kCodeSurface.most_factor)
                              : kCodeSurface.most_factor;
    const double next = coding * factor;
    const bool inside = (low_ == 0 || next > low_) && (high_ == 0 || next < high_);
    return inside ? next : std::sqrt(low_ * high_);
  }

 private:
  double limit_, own_;
  double low_ = 0, high_ = 0;  // kept, not kept
};

absl::StatusOr<double> ErrorOf(const EncodedSurface& encoded, const ControlOptions& control,
                               const SearchableShape& points, const PipelineContext& context) {
  const StageScope scope(Stage::kMeasure, context);
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(encoded.Concatenate(), context));
  RILIEVO_ASSIGN_OR_RETURN(
      const TwoSidedError error,
      MeasureSurface(decoded.surface, FilledVertices(decoded.surface, control), points, context));
  return error.across_rms;
}

}  // namespace

Eigen::Matrix3Xd SomePoints(const Eigen::Matrix3Xd& points) {
  const Eigen::Index most = kCertificate.certified_samples;
  const Eigen::Index stride = (points.cols() + most - 1) / most;
  Eigen::Matrix3Xd some(3, (points.cols() + stride - 1) / stride);
  for (Eigen::Index i = 0; i < some.cols(); ++i) some.col(i) = points.col(i * stride);
  return some;
}

DssMetadata WithWidestFigures(DssMetadata metadata, bool measured, int64_t faces) {
  if (measured) {
    metadata.error_rms = metadata.error_mean = metadata.error_p95 = metadata.error_max =
        kCodeSurface.wide;
    metadata.error_across = kCodeSurface.wide;
    metadata.surface_to_scan = metadata.scan_to_surface = {kCodeSurface.wide, kCodeSurface.wide,
                                                           kCodeSurface.wide, kCodeSurface.wide};
  }
  metadata.measured_share = metadata.smoothed_share = metadata.filled_share = kCodeSurface.wide;
  metadata.folds = faces;
  return metadata;
}

double ErrorUnderNoise(double distance, double noise, double leverage) {
  return distance < 2 * noise ? std::min(distance, std::sqrt(leverage) * noise) : distance;
}

double OwnError(const UncodedError& uncoded) {
  const DistanceSummary& distance = uncoded.error.b_to_a;
  const double own = uncoded.measured ? std::min(distance.rms, distance.p95 / 2) : 0;
  return std::max(kCodeSurface.spacings * uncoded.spacing,
                  ErrorUnderNoise(own, uncoded.noise, uncoded.leverage));
}

double CodingError(const UncodedError& uncoded) {
  return std::clamp(kCodeSurface.share_of_own * OwnError(uncoded), kCodeSurface.finest,
                    kCodeSurface.coarsest);
}

bool NoiseAllows(double max_error, double noise) {
  return max_error > kCodeSurface.noise_room * noise;
}

double CodingErrorWithin(double max_error, const UncodedError& uncoded) {
  const double distance = uncoded.error.across_rms;
  if (uncoded.measured && distance >= 0 && distance < max_error &&
      NoiseAllows(max_error, uncoded.noise)) {
    const double aim = kCodeSurface.aim_measured * max_error;
    const double least = (max_error * max_error - distance * distance) / 4;
    const double left = std::max(aim * aim - distance * distance, least);
    return std::clamp(std::sqrt(left), kCodeSurface.finest, kCodeSurface.coarsest);
  }
  const double own = OwnError(uncoded), aim = kCodeSurface.aim * max_error;
  const double left = std::sqrt(std::max(0.0, aim * aim - own * own));
  return std::clamp(std::max(left, kCodeSurface.share_of_own * own), kCodeSurface.finest,
                    kCodeSurface.coarsest);
}

std::optional<double> CodingErrorFor(const EncodeOptions& encode, const UncodedError& uncoded) {
  if (encode.max_error) return CodingErrorWithin(*encode.max_error, uncoded);
  if (encode.height_step > 0 || encode.max_bytes) return std::nullopt;
  return CodingError(uncoded);
}

absl::StatusOr<CodedSurface> CodeSurface(const OrientedCloud& cloud, const Shape& mesh,
                                         SampledSurface sampled, const DssMetadata& metadata,
                                         const ReconstructOptions& options,
                                         const PipelineContext& context) {
  CodedSurface coded;
  coded.uncoded = {cloud.median_spacing, cloud.median_noise, sampled.leverage, options.measure, {}};
  if (options.measure) {
    Shape shape = std::move(sampled.shape);
    shape.filled = FilledVertices(sampled.surface, options.control);
    RILIEVO_ASSIGN_OR_RETURN(
        coded.uncoded.error,
        Measure(cloud, mesh, shape, options.encode.max_error.has_value(), context));
  }
  coded.domain = std::move(sampled.domain);
  coded.surface = std::move(sampled.surface);
  coded.metadata = metadata;
  coded.metadata.smoothed_share = ShareOf(HeightSource::kSmoothed, coded.surface);
  RILIEVO_ASSIGN_OR_RETURN(
      coded.encoded,
      Encode(coded, CodingErrorFor(options.encode, coded.uncoded), options, context));
  return coded;
}

absl::StatusOr<EncodedSurface> CodeWithinBytes(const CodedSurface& coded,
                                               const ReconstructOptions& options,
                                               const PipelineContext& context) {
  return Encode(coded, std::nullopt, options, context);
}

absl::StatusOr<CodedSurface> KeepError(const OrientedCloud& cloud, const Shape& mesh,
                                       CodedSurface coded, const ReconstructOptions& options,
                                       const PipelineContext& context) {
  coded.keeps_error = !options.encode.max_error || !options.measure;
  if (coded.keeps_error) return coded;
  const double limit = *options.encode.max_error, own = coded.uncoded.error.across_rms;
  if (own >= limit || !NoiseAllows(limit, coded.uncoded.noise)) return coded;
  const PipelineContext silent = context.Silent();
  RILIEVO_ASSIGN_OR_RETURN(const SearchableShape points,
                           MakeSearchable(ShapeToMeasure(cloud, mesh), silent));
  const auto error_of = [&](const EncodedSurface& encoded) {
    return ErrorOf(encoded, options.control, points, silent);
  };
  const auto encode = [&](double coding) { return Encode(coded, coding, options, silent); };
  RILIEVO_ASSIGN_OR_RETURN(
      coded.keeps_error, KeepErrorOf(limit, own, CodingErrorWithin(limit, coded.uncoded), error_of,
                                     encode, &coded.encoded));
  return coded;
}

absl::StatusOr<bool> KeepErrorOf(
    double limit, double own, double coding,
    const std::function<absl::StatusOr<double>(const EncodedSurface& encoded)>& error_of,
    const std::function<absl::StatusOr<EncodedSurface>(double coding)>& encode,
    EncodedSurface* encoded) {
  KeepSearch search(limit, own);
  std::optional<EncodedSurface> kept;
  double kept_coding = 0;  // the coarsest that kept the error
  for (int round = 0; round < kCodeSurface.keep_error_rounds; ++round) {
    RILIEVO_ASSIGN_OR_RETURN(const double error, error_of(*encoded));
    if (error <= limit) {
      // Coarser than all coefficients at zero there is nothing.
      if (kept && coding > kept_coding && BytesOf(*encoded) >= BytesOf(*kept)) break;
      if (!kept || BytesOf(*encoded) < BytesOf(*kept)) kept = *encoded;
      kept_coding = std::max(kept_coding, coding);
    }
    double next = search.Next(coding, error);
    if (next > 0) next = std::clamp(next, kCodeSurface.finest, kCodeSurface.coarsest);
    if (next == 0 || next == coding || round + 1 == kCodeSurface.keep_error_rounds) break;
    coding = next;
    RILIEVO_ASSIGN_OR_RETURN(*encoded, encode(coding));
  }
  const bool keeps = kept.has_value();
  if (kept) *encoded = *std::move(kept);
  return keeps;
}

int64_t BytesOf(const EncodedSurface& encoded) {
  int64_t bytes = 0;
  for (const auto& chunk : encoded.chunks) bytes += static_cast<int64_t>(chunk.size());
  return bytes;
}

}  // namespace rilievo
