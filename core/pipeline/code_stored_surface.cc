#include "core/pipeline/code_stored_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/codec/container/decode_region.h"
#include "core/codec/container/encode_dss_blocks.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/mesh/face_groups.h"
#include "core/pipeline/certificate.h"
#include "core/surface/measure_parts.h"

namespace rilievo {
namespace {

using FaceLists = std::vector<std::vector<int>>;

// Compact parts of the control faces, for the triangles of the finest level.
FaceLists PartsToMeasure(const StoredSurface& surface, const MeshTopology& control,
                         int64_t block_vertices) {
  constexpr double kGrid = 1 << 20;  // per diagonal
  std::vector<GridPoint> points(control.vertex_count);
  for (int v = 0; v < control.vertex_count; ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      points[v][axis] =
          static_cast<int32_t>(std::lround(kGrid * surface.control_mesh.vertices(axis, v)));
    }
  }
  const int64_t vertices = VertexCountAt(control, surface.max_level);
  const int64_t faces = std::max<int64_t>(1, block_vertices * control.face_count() / vertices);
  return GroupFaces(control, points, static_cast<int>(faces)).members;
}

double AreaOf(const ControlMesh& mesh) {
  double area = 0;
  for (const auto face : mesh.faces.colwise()) {
    const Eigen::Vector3d a = mesh.vertices.col(face[0]);
    const Eigen::Vector3d ab = mesh.vertices.col(face[1]) - a;
    area += ab.cross(mesh.vertices.col(face[2]) - a).norm() / 2;
  }
  return area;
}

class StoredCoding {
 public:
  StoredCoding(const StoredSurface& surface, const PartCutter& cutter, int64_t block_vertices,
               const ReconstructOptions& options, const PipelineContext& context)
      : surface_(surface),
        cutter_(cutter),
        block_vertices_(block_vertices),
        options_(options),
        context_(context),
        faces_(PartsToMeasure(surface, cutter.topology(), block_vertices)) {}

  // As given.
  SurfaceParts Uncoded() const {
    return Parts([this](std::span<const int> faces, const RunContext& /*context*/) {
      return ReadPart(surface_, cutter_, faces, 0);
    });
  }

  // `file` is kept by reference.
  SurfaceParts Decoded(const OpenedDss& file) const {
    return Parts([this, &file](std::span<const int> faces, const RunContext& context) {
      return DecodePart(file, cutter_, faces, context);
    });
  }

  absl::StatusOr<EncodedSurface> Encode(const DssMetadata& metadata, double position_step,
                                        std::optional<double> coding_error) const {
    const StageScope scope(Stage::kEncode, context_);
    EncodeOptions encode = options_.encode;
    encode.position_step = position_step;
    encode.max_error = coding_error;
    const int64_t faces = int64_t{cutter_.topology().face_count()} << (2 * surface_.max_level);
    return EncodeDssBlocks(surface_, cutter_, WithWidestFigures(metadata, options_.measure, faces),
                           encode, block_vertices_, context_);
  }

  // Errors only if there are points.
  absl::StatusOr<PartsError> Measure(const SurfaceParts& parts,
                                     const SearchableShape* points) const {
    const StageScope scope(Stage::kMeasure, context_);
    if (points == nullptr) return CountParts(parts, context_);
    return MeasureParts(parts, *points, MeasureOptions{kCertifiedSamples}, context_);
  }

  absl::StatusOr<PartsError> MeasureBytes(const EncodedSurface& encoded,
                                          const SearchableShape* points) const {
    const std::vector<uint8_t> bytes = encoded.Concatenate();
    RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(bytes, true));
    return Measure(Decoded(file), points);
  }

 private:
  template <typename Read>
  SurfaceParts Parts(const Read& read) const {
    SurfaceParts parts;
    parts.count = static_cast<int>(faces_.size());
    parts.area = AreaOf(surface_.control_mesh);
    parts.triangles = [this, read](int i,
                                   const RunContext& context) -> absl::StatusOr<PartTriangles> {
      RILIEVO_ASSIGN_OR_RETURN(const SurfacePart part, read(faces_[i], context));
      RILIEVO_ASSIGN_OR_RETURN(PartTriangles triangles, TrianglesOfPart(part, context));
      if (!options_.control.fills_holes()) triangles.shape.filled.clear();
      return triangles;
    };
    return parts;
  }

  const StoredSurface& surface_;
  const PartCutter& cutter_;
  int64_t block_vertices_;
  const ReconstructOptions& options_;
  const PipelineContext& context_;
  FaceLists faces_;
};

double ShareOfSource(HeightSource source, const std::array<int64_t, 3>& counts) {
  const int64_t all = counts[0] + counts[1] + counts[2];
  return static_cast<double>(counts[static_cast<size_t>(source)]) /
         static_cast<double>(std::max<int64_t>(1, all));
}

}  // namespace

std::optional<int> GroupFacesFor(const StoredSurface& surface, const PartCutter& cutter,
                                 int64_t block_vertices, const EncodeOptions& options) {
  constexpr int64_t kMostFaces = 1024;
  const int64_t vertices = VertexCountAt(cutter.topology(), surface.max_level);
  const int64_t faces = cutter.topology().face_count();
  if (vertices <= block_vertices || surface.max_level < kFirstGroupedLevel) return std::nullopt;
  const int64_t fitting = block_vertices * faces / vertices;
  const auto group = options.group_faces >= 0
                         ? int64_t{options.group_faces}
                         : std::clamp<int64_t>(fitting, kLeastGroupLimit, kMostFaces);
  if (group == 0 || faces <= group) return std::nullopt;
  return static_cast<int>(group);
}

absl::StatusOr<CodedStoredSurface> CodeStoredSurface(
    const StoredSurface& surface, const PartCutter& cutter, OrientedCloud cloud,
    double position_step, const DssMetadata& metadata, int64_t block_vertices,
    const ReconstructOptions& options, const PipelineContext& context) {
  const StoredCoding coding(surface, cutter, block_vertices, options, context);
  CodedStoredSurface coded;
  coded.uncoded = {cloud.median_spacing, cloud.median_noise, options.measure, {}};
  std::optional<SearchableShape> points;
  if (options.measure) {
    RILIEVO_ASSIGN_OR_RETURN(points, MakeSearchable(PointsToMeasure(std::move(cloud)), context));
    if (options.encode.max_error) {
      RILIEVO_ASSIGN_OR_RETURN(const PartsError found, coding.Measure(coding.Uncoded(), &*points));
      coded.uncoded.error = found.error;
    } else {
      const StageScope scope(Stage::kMeasure, context);
      RILIEVO_ASSIGN_OR_RETURN(
          coded.uncoded.error.b_to_a,
          MeasureToParts(SomePoints(points->shape.vertices), coding.Uncoded(), context));
    }
  }
  cloud = OrientedCloud();
  const SearchableShape* const against = points ? &*points : nullptr;
  coded.metadata = metadata;
  coded.metadata.smoothed_share = ShareOfSource(HeightSource::kSmoothed, surface.source_counts);
  const auto encode = [&](std::optional<double> error) {
    return coding.Encode(coded.metadata, position_step, error);
  };
  RILIEVO_ASSIGN_OR_RETURN(coded.encoded, encode(CodingErrorFor(options.encode, coded.uncoded)));
  if (options.encode.max_error && options.measure) {
    const double limit = *options.encode.max_error, own = coded.uncoded.error.across_rms;
    const auto error_of = [&](const EncodedSurface& encoded) -> absl::StatusOr<double> {
      RILIEVO_ASSIGN_OR_RETURN(const PartsError found, coding.MeasureBytes(encoded, against));
      return found.error.across_rms;
    };
    if (own < limit && NoiseAllows(limit, coded.uncoded.noise)) {
      RILIEVO_RETURN_IF_ERROR(KeepErrorOf(limit, own, CodingErrorWithin(limit, coded.uncoded),
                                          error_of, encode, &coded.encoded)
                                  .status());
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(const PartsError found, coding.MeasureBytes(coded.encoded, against));
  coded.error = found.error;
  if (points) StateErrors(found.error, &coded.metadata);
  coded.metadata.folds = found.folds;
  StateShares(ShareOfSource(HeightSource::kFilled, found.source_counts),
              ShareOfSource(HeightSource::kSmoothed, found.source_counts), &coded.metadata);
  RILIEVO_RETURN_IF_ERROR(ReplaceMetadata(coded.metadata, coded.encoded));
  return coded;
}

}  // namespace rilievo
