// What a .dss says of itself, and the proof of it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/control/control_options.h"
#include "core/geometry/point_cloud.h"
#include "core/pipeline/stage_scope.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// Enough to tell scans apart: two of a thousand million have the same one with a chance of 3 %.
// A proof against a forger it is not, who could as well write another certificate.
inline constexpr size_t kHashBytes = 8;

// The first kHashBytes bytes of the SHA-256 of all points in their order: x, y, z as little-endian
// doubles, what is not a number as the quiet NaN. The same for every file that holds these numbers.
std::string HashOfScan(const PointCloud& scan);

// By vertex, whether its height was filled in on purpose, for Shape::filled: none where `control`
// asks for no filling, for then a part of the surface without points is an error of it.
std::vector<uint8_t> FilledVertices(const DisplacedSurface& surface, const ControlOptions& control);

// Two-sided error of the surface's finest level against points of its unit frame: 50 000 samples of
// the surface and every point. Their RMS is within 1 % of that of 200 000 samples. `filled`: see
// FilledVertices().
absl::StatusOr<TwoSidedError> MeasureSurface(const DisplacedSurface& surface,
                                             std::vector<uint8_t> filled, const Shape& points,
                                             const RunContext& context);

// The same against points whose tree is there already.
absl::StatusOr<TwoSidedError> MeasureSurface(const DisplacedSurface& surface,
                                             std::vector<uint8_t> filled,
                                             const SearchableShape& points,
                                             const RunContext& context);

// The same of a surface that is triangles already.
absl::StatusOr<TwoSidedError> MeasureTriangles(const Shape& surface, const Shape& points,
                                               const RunContext& context);

// What errors are measured against: `mesh` where it has triangles, else PointsToMeasure().
Shape ShapeToMeasure(const OrientedCloud& cloud, const Shape& mesh);

// The points of a scan as errors are measured against, with their normals and with three spacings
// as their gaps: holes of about twenty points still count as seen.
Shape PointsToMeasure(OrientedCloud cloud);

// Of the heights, those that have this source.
double ShareOf(HeightSource source, const DisplacedSurface& surface);

// The finest level in the unit frame.
absl::StatusOr<Shape> FinestTriangles(const DisplacedSurface& surface, const RunContext& context);

// Writes figures of the decoded surface where a file states them.
void StateErrors(const TwoSidedError& error, DssMetadata* metadata);
// `smoothed` 0: the file does not tell, and what is there stays.
void StateShares(double filled, double smoothed, DssMetadata* metadata);

struct Certificate {
  DssMetadata metadata;
  TwoSidedError error;  // all zero without points
};

// `stated`, with what the decoded surface shows instead: the errors against `points` (unless null),
// folds, shares filled in and smoothed; `measured_share` becomes what these leave. Where the file
// tells no height to be smoothed (few, or a file that is not whole or older) that share is the
// maker's word.
absl::StatusOr<Certificate> CertifySurface(const DisplacedSurface& decoded,
                                           const SearchableShape* points, DssMetadata stated,
                                           const PipelineContext& context);

struct CertifiedBytes {
  EncodedSurface encoded;  // with the certificate in them
  TwoSidedError error;     // all zero without points
};

// Decodes the bytes that go out, and writes into them what they are worth. `points`: those of the
// scan, or the given mesh (ShapeToMeasure), unless errors are not to be measured. `metadata`: what
// the maker states.
absl::StatusOr<CertifiedBytes> Certify(EncodedSurface encoded, const DssMetadata& metadata,
                                       std::optional<Shape> points, const PipelineContext& context);

struct CertifiedFigure {
  std::string name;
  double stated = -1, found = -1;
  bool agrees = false;  // to 3e-4 of the figure: those in the file have 11 binary digits
};

enum class StatedScan {
  kNotGiven,  // errors are not recomputed
  kSame,
  kOther,    // the hashes differ
  kUnknown,  // the file does not say which scan it was made from
};

// Of the figures that the file states those that `found` has too. `with_errors`: the errors among
// them.
std::vector<CertifiedFigure> CompareFigures(const DssMetadata& stated, const DssMetadata& found,
                                            bool with_errors);

struct Verification {
  StatedScan scan = StatedScan::kNotGiven;
  bool complete = true;                  // all layers are there
  std::vector<CertifiedFigure> figures;  // those the file states and this run could recompute
  bool agrees() const;
};

// Recomputes what the file states about itself. With its own scan the errors too: the scan is
// checked and cleaned as the stated options ask, for the errors are those of the points that were
// used. `decoded` has passed all checksums. INVALID_ARGUMENT for options of an unknown kind, and
// for a scan where the surface was made by parts (VerifyPaged() in verify_pages.h).
absl::StatusOr<Verification> VerifyCertificate(const DecodedSurface& decoded,
                                               const PointCloud* scan, const RunContext& context);

}  // namespace rilievo
