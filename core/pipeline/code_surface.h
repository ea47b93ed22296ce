// How exactly a surface is worth coding, and the coding.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>

#include "absl/status/statusor.h"
#include "core/codec/container/dss.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/settings.h"
#include "core/pipeline/stage_scope.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// How far a surface lies from its points before it is coded; fractions of the diagonal.
struct UncodedError {
  double spacing = 0, noise = 0;  // medians of the points
  double leverage = 1;            // as in SolvedHeights
  bool measured = false;          // what follows
  // Of the points from the surface; with encode.max_error all that the certificate will state.
  TwoSidedError error;
};

// What a surface errs whose points are `distance` off it. Where most of that is noise (a standard
// deviation) the surface has not followed it, and errs by sqrt(leverage) times the noise at most.
double ErrorUnderNoise(double distance, double noise, double leverage);

// Estimate of the surface's RMS distance from the truth: on a clean scan that of the points from
// the surface, on a noisy one ErrorUnderNoise(). Of the distances
// the quieter of the RMS and half the 95th percentile counts, so that a few outliers do not coarsen
// the rest. An eightieth of the spacing at least: a surface through its points is off between them.
double OwnError(const UncodedError& uncoded);

// Whether a surface that does not follow the noise, a standard deviation, can be within `max_error`
// of the points: that has to leave it at least half of the noise, 1.12^2 = 1 + 0.5^2.
bool NoiseAllows(double max_error, double noise);

// RMS error of the coded heights that raises the surface's own error by a twentieth at most.
double CodingError(const UncodedError& uncoded);

// The same where the coded surface is to be within `max_error` of the points, as the certificate
// measures it (TwoSidedError::across_rms): errors of different origin add up as squares. Where the
// surface's own distance is larger already, or noise does not allow that (NoiseAllows),
// `max_error` is taken as meant against the truth, and shared with OwnError(). CodingError()
// where that too is larger. Without measuring there is OwnError() alone.
double CodingErrorWithin(double max_error, const UncodedError& uncoded);

// The error that the heights are coded with; unset where the options ask for a step or for bytes.
std::optional<double> CodingErrorFor(const EncodeOptions& encode, const UncodedError& uncoded);

// Points spread evenly over the scan, for they are in Morton order; at most
// kCertificate.certified_samples.
Eigen::Matrix3Xd SomePoints(const Eigen::Matrix3Xd& points);

// With figures that take as many bytes as any, so that a size kept with them is kept with the true
// ones.
DssMetadata WithWidestFigures(DssMetadata metadata, bool measured, int64_t faces);

struct CodedSurface {
  Domain domain;
  DisplacedSurface surface;  // before coding
  EncodedSurface encoded;    // room is kept for the figures of the certificate
  DssMetadata metadata;
  UncodedError uncoded;
  bool keeps_error = false;  // encode.max_error, as the certificate measures it: see KeepError()
};

// Measures how far the surface lies from the points of the cloud, and for an error asked for from
// what ShapeToMeasure() says, and encodes it. `mesh`: the given one, unit frame; without triangles
// where a scan was given. `metadata`: what is known before. RESOURCE_EXHAUSTED when
// encode.max_bytes cannot be kept.
absl::StatusOr<CodedSurface> CodeSurface(const OrientedCloud& cloud, const Shape& mesh,
                                         SampledSurface sampled, const DssMetadata& metadata,
                                         const ReconstructOptions& options,
                                         const PipelineContext& context);

// Codes coded.surface once more, within encode.max_bytes, which is asked for. The errors of
// EncodeDss().
absl::StatusOr<EncodedSurface> CodeWithinBytes(const CodedSurface& coded,
                                               const ReconstructOptions& options,
                                               const PipelineContext& context);

// Decodes what was coded, measures it as the certificate does, and codes the heights more finely,
// or more coarsely where that takes fewer bytes, until the RMS across the surface is at most
// encode.max_error and close to it: `keeps_error`. Else `encoded` is the nearest one tried, or
// untouched where the surface itself is farther off than that or noise does not allow it. Without
// max_error or without measuring there is nothing to keep: as given.
absl::StatusOr<CodedSurface> KeepError(const OrientedCloud& cloud, const Shape& mesh,
                                       CodedSurface coded, const ReconstructOptions& options,
                                       const PipelineContext& context);

// The search of it: `coding` gave `encoded`, `own` is the error of the surface before it is coded.
// False, with `encoded` the last one tried, where none keeps `limit`.
absl::StatusOr<bool> KeepErrorOf(
    double limit, double own, double coding,
    const std::function<absl::StatusOr<double>(const EncodedSurface& encoded)>& error_of,
    const std::function<absl::StatusOr<EncodedSurface>(double coding)>& encode,
    EncodedSurface* encoded);

int64_t BytesOf(const EncodedSurface& encoded);

}  // namespace rilievo
