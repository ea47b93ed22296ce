#include "core/pipeline/code_stored_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
#include "core/codec/container/decode_region.h"
#include "core/codec/container/encode_dss_blocks.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/mesh/face_groups.h"
#include "core/geometry/vertex_normals.h"
#include "core/paging/paged_scan.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/compact_parts.h"
#include "core/pipeline/run_parts.h"
#include "core/pipeline/settings.h"
#include "core/pipeline/shared_coding.h"
#include "core/surface/heights_in_memory.h"
#include "core/surface/measure_parts.h"

namespace rilievo {
namespace {

using FaceLists = std::vector<std::vector<int>>;

// Parts of the control faces, each with about block.vertices of the finest level or with
// block.points of the `points` near it, whichever makes it smaller.
FaceLists PartsToMeasure(const StoredSurface& surface, const MeshTopology& control,
                         const BlockSize& block, int64_t points) {
  const auto share = [&control](int64_t most, int64_t all) {
    return most * control.face_count() / std::max<int64_t>(all, 1);
  };
  const int64_t vertices = VertexCountAt(control, surface.max_level);
  const int64_t faces =
      std::clamp<int64_t>(std::min(share(block.vertices, vertices), share(block.points, points)), 1,
                          control.face_count());
  return CompactParts(surface.control_mesh, control, faces);
}

double AreaOf(const ControlMesh& mesh) {
  double area = 0;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    area += FaceCross(mesh.vertices, mesh.faces, f).norm() / 2;
  }
  return area;
}

std::vector<int> AllFaces(int64_t count) {
  std::vector<int> faces(static_cast<size_t>(count));
  std::iota(faces.begin(), faces.end(), 0);
  return faces;
}

template <typename Archive, typename Part>
void VisitMeasured(Archive& archive, Part& part) {
  archive(part.box);
  archive(part.folds);
  archive(part.source_counts);
  archive(part.squared);
  archive(part.largest);
  archive(part.across_sum);
  archive(part.across_count);
  archive(part.pages);
  archive(part.in_reach);
  archive(part.squared_of_points);
}

class StoredCoding {
 public:
  // `points` may be null: then nothing is measured. So may `shared`.
  StoredCoding(const StoredSurface& surface, const PartCutter& cutter, PointPages* points,
               const BlockSize& block, SharedParts* shared, const ReconstructOptions& options,
               const PipelineContext& context)
      : surface_(surface),
        cutter_(cutter),
        points_(points),
        block_(block),
        shared_(shared),
        options_(options),
        context_(context),
        faces_(PartsToMeasure(surface, cutter.topology(), block,
                              points != nullptr ? points->count() * int64_t{kPagePoints} : 0)) {}

  // Whether others code some of the blocks: where they need to know the heights alone for it.
  bool IsShared() const {
    return shared_ != nullptr && block_.in_groups && !options_.encode.max_error &&
           !options_.encode.max_bytes;
  }

  // Within the error asked for, or as exactly as the points are worth.
  absl::Status Code(const ThinnedPoints& thinned, double position_step,
                    CodedStoredSurface* coded) const {
    const std::optional<double> limit = options_.encode.max_error;
    UncodedError& uncoded = coded->uncoded;
    const auto find = [&]() -> absl::Status {
      RILIEVO_ASSIGN_OR_RETURN(uncoded, ErrorBefore(thinned));
      return absl::OkStatus();
    };
    RILIEVO_RETURN_IF_ERROR(IsShared() ? ShareUncoded(find, shared_, context_, &uncoded) : find());
    const auto encode = [&](std::optional<double> error) {
      return Encode(coded->metadata, position_step, error);
    };
    RILIEVO_ASSIGN_OR_RETURN(coded->encoded, encode(CodingErrorFor(options_.encode, uncoded)));
    const double own = uncoded.error.across_rms;
    if (!limit || !options_.measure || own >= *limit || !NoiseAllows(*limit, uncoded.noise)) {
      return absl::OkStatus();
    }
    const auto error_of = [&](const EncodedSurface& encoded) -> absl::StatusOr<double> {
      RILIEVO_ASSIGN_OR_RETURN(const PartsError found, MeasureBytes(encoded.Concatenate()));
      return found.error.across_rms;
    };
    return KeepErrorOf(*limit, own, CodingErrorWithin(*limit, uncoded), error_of, encode,
                       &coded->encoded)
        .status();
  }

  // Codes blocks for the process that leads.
  absl::Status Help(double position_step) const {
    if (!IsShared()) return absl::OkStatus();
    UncodedError uncoded;
    RILIEVO_RETURN_IF_ERROR(
        ShareUncoded([] { return absl::InternalError("one who helps was to lead"); }, shared_,
                     context_, &uncoded));
    return HelpToEncodeDssBlocks(
        surface_, cutter_,
        EncodeOptionsFor(position_step, CodingErrorFor(options_.encode, uncoded)), block_.vertices,
        context_, Gathering());
  }

  // Whether they are of this surface, and where it is measured by parts in groups. A surface that
  // fits into a block may be in groups too.
  bool AreOfSurface(const EncodedSurface& encoded) const {
    const std::vector<uint8_t> bytes = encoded.Concatenate();
    const absl::StatusOr<OpenedDss> file = OpenDss(bytes, true);
    if (!file.ok() || !file->whole() || file->topology.faces != cutter_.topology().faces) {
      return false;
    }
    return !block_.in_groups || (file->header.group_limit > 0 &&
                                 file->layers.size() > static_cast<size_t>(kFirstGroupedLevel));
  }

  // Some parts of it by those who share it, unless that is null. The one who leads is told the
  // errors, the others nothing.
  absl::StatusOr<PartsError> MeasureBytes(std::span<const uint8_t> bytes,
                                          SharedParts* shared = nullptr) const {
    if (block_.in_groups) {
      RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(bytes, true));
      RILIEVO_ASSIGN_OR_RETURN(const PartDecoder decoder,
                               PartDecoder::Open(file, cutter_, context_));
      return Measure(PartsOf(decoder), shared);
    }
    RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(bytes, context_));
    const HeightsInMemory heights(decoded.surface, cutter_.topology());
    const StoredSurface stored = Stored(decoded.surface, heights);
    return Measure(PartsOf(stored), shared);
  }

 private:
  // Before the heights are coded.
  absl::StatusOr<UncodedError> ErrorBefore(const ThinnedPoints& thinned) const {
    UncodedError uncoded{
        thinned.median_spacing, thinned.median_noise, thinned.leverage, options_.measure, {}};
    if (!options_.measure) return uncoded;
    if (options_.encode.max_error) {
      RILIEVO_ASSIGN_OR_RETURN(const PartsError found, Measure(PartsOf(surface_)));
      uncoded.error = found.error;
      return uncoded;
    }
    const StageScope scope(Stage::kMeasure, context_);
    RILIEVO_ASSIGN_OR_RETURN(uncoded.error.b_to_a,
                             MeasureToParts(thinned.some, PartsOf(surface_), context_));
    return uncoded;
  }

  GatherBytes Gathering() const { return IsShared() ? GatherByParts(shared_) : GatherBytes(); }

  EncodeOptions EncodeOptionsFor(double position_step, std::optional<double> coding_error) const {
    EncodeOptions encode = options_.encode;
    encode.position_step = position_step;
    encode.max_error = coding_error;
    return encode;
  }

  SurfaceParts PartsOf(const PartDecoder& decoder) const {
    return Parts([&decoder](std::span<const int> faces, const RunContext& context) {
      return decoder.Decode(faces, context);
    });
  }

  SurfaceParts PartsOf(const StoredSurface& surface) const {
    return Parts([this, &surface](std::span<const int> faces, const RunContext& /*context*/) {
      return ReadPart(surface, cutter_, faces, 0);
    });
  }

  absl::StatusOr<EncodedSurface> Encode(const DssMetadata& given, double position_step,
                                        std::optional<double> coding_error) const {
    const StageScope scope(Stage::kEncode, context_);
    const EncodeOptions encode = EncodeOptionsFor(position_step, coding_error);
    const int64_t faces = int64_t{cutter_.topology().face_count()} << (2 * surface_.max_level);
    const DssMetadata metadata = WithWidestFigures(given, options_.measure, faces);
    if (block_.in_groups) {
      return EncodeDssBlocks(surface_, cutter_, metadata, encode, block_.vertices, context_,
                             Gathering());
    }
    RILIEVO_ASSIGN_OR_RETURN(const DisplacedSurface whole, ReadWhole(surface_, cutter_));
    return EncodeDss(whole, metadata, encode, context_);
  }

  // Errors only if there are points.
  absl::StatusOr<PartsError> Measure(const SurfaceParts& parts,
                                     SharedParts* shared = nullptr) const {
    const StageScope scope(Stage::kMeasure, context_);
    if (points_ == nullptr) return CountParts(parts, context_);
    std::vector<MeasuredPart> measured(static_cast<size_t>(parts.count));
    PartsOfStep step{.step = PartStep::kMeasured, .count = parts.count};
    step.make = [&](int part, const RunContext& own) -> absl::StatusOr<std::vector<uint8_t>> {
      RILIEVO_ASSIGN_OR_RETURN(
          MeasuredPart found,
          MeasurePart(parts, part, MeasureOptions{kCertificate.certified_samples}, own, *points_));
      if (shared == nullptr) {
        measured[static_cast<size_t>(part)] = std::move(found);
        return std::vector<uint8_t>();
      }
      ValueWriter writer;
      VisitMeasured(writer, found);
      return std::move(writer.bytes);
    };
    step.take = [&](int part, std::span<const uint8_t> of_part) -> absl::Status {
      MeasuredPart& found = measured[static_cast<size_t>(part)];
      if (shared != nullptr) {
        ValueReader reader(of_part);
        VisitMeasured(reader, found);
        if (!reader.Finished()) return NotOfPart(PartStep::kMeasured, part);
      }
      return TakeDistances(&found, points_);
    };
    points_->ForgetDistances();
    const auto tell = [this](double share) { context_.Report(Stage::kMeasure, share); };
    RILIEVO_RETURN_IF_ERROR(RunParts(step, {tell, shared}, context_));
    if (shared != nullptr && !shared->leads()) return PartsError();
    return SumOfParts(parts, measured, context_, points_);
  }

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
  PointPages* points_;
  BlockSize block_;
  SharedParts* shared_;
  const ReconstructOptions& options_;
  const PipelineContext& context_;
  FaceLists faces_;
};

constexpr char kCodedName[] = "coded";

// Takes what was coded.
PartsOfStep StepOfCoding(const StoredCoding& coding, CodedStoredSurface* coded) {
  PartsOfStep step{.step = PartStep::kCoded, .count = 1};
  step.take = [&coding, coded](int part, std::span<const uint8_t> bytes) {
    return ReadCoded(bytes, coded) && coding.AreOfSurface(coded->encoded)
               ? absl::OkStatus()
               : NotOfPart(PartStep::kCoded, part);
  };
  return step;
}

}  // namespace

double ShareOfSource(HeightSource source, const std::array<int64_t, 3>& counts) {
  const int64_t all = counts[0] + counts[1] + counts[2];
  return static_cast<double>(counts[static_cast<size_t>(source)]) /
         static_cast<double>(std::max<int64_t>(1, all));
}

std::optional<int> GroupFacesFor(const StoredSurface& surface, const PartCutter& cutter,
                                 int64_t block_vertices, const EncodeOptions& options) {
  const int64_t vertices = VertexCountAt(cutter.topology(), surface.max_level);
  const int64_t faces = cutter.topology().face_count();
  if (vertices <= block_vertices || surface.max_level < kFirstGroupedLevel) return std::nullopt;
  const int64_t fitting = block_vertices * faces / vertices;
  const auto group = options.group_faces >= 0 ? int64_t{options.group_faces}
                                              : std::clamp<int64_t>(fitting, kLeastGroupLimit,
                                                                    kCodeStoredSurface.most_faces);
  if (group == 0 || faces <= group) return std::nullopt;
  return static_cast<int>(group);
}

absl::StatusOr<DisplacedSurface> ReadWhole(const StoredSurface& stored, const PartCutter& cutter) {
  DisplacedSurface surface;
  surface.frame = stored.frame;
  surface.control_mesh = stored.control_mesh;
  surface.max_level = stored.max_level;
  RILIEVO_RETURN_IF_ERROR(stored.heights->Read(AllFaces(cutter.topology().face_count()),
                                               FaceVertices(cutter.topology(), stored.max_level),
                                               &surface.heights, &surface.sources));
  return surface;
}

absl::StatusOr<CodedStoredSurface> CodeStoredSurface(
    const StoredSurface& surface, const PartCutter& cutter, const ThinnedPoints& thinned,
    PointPages* points, double position_step, const DssMetadata& metadata, const BlockSize& block,
    const ScratchFolder& scratch, SharedParts* shared, const ReconstructOptions& options,
    const PipelineContext& context) {
  if (!options.measure) points = nullptr;
  const StoredCoding coding(surface, cutter, points, block, shared, options, context);
  CodedStoredSurface coded;
  coded.metadata = metadata;
  coded.metadata.smoothed_share = ShareOfSource(HeightSource::kSmoothed, surface.source_counts);
  PartsOfStep step = StepOfCoding(coding, &coded);
  step.is_there = [&](int part) {
    const std::optional<std::vector<uint8_t>> saved = scratch.Load(kCodedName);
    return saved && step.take(part, *saved).ok();
  };
  // Of a process that shares steps, one never lies within another.
  if (coding.IsShared()) RILIEVO_RETURN_IF_ERROR(coding.Code(thinned, position_step, &coded));
  step.make = [&](int /*part*/,
                  const RunContext& /*context*/) -> absl::StatusOr<std::vector<uint8_t>> {
    if (!coding.IsShared()) {
      coded.encoded = {};
      RILIEVO_RETURN_IF_ERROR(coding.Code(thinned, position_step, &coded));
    }
    std::vector<uint8_t> bytes = BytesOfCoded(coded);
    RILIEVO_RETURN_IF_ERROR(scratch.Save(kCodedName, bytes));
    return bytes;
  };
  RILIEVO_RETURN_IF_ERROR(RunParts(step, {[](double /*share*/) {}, shared}, context));
  const std::vector<uint8_t> bytes = coded.encoded.Concatenate();
  RILIEVO_ASSIGN_OR_RETURN(const PartsError found,
                           coding.MeasureBytes(bytes, points != nullptr ? shared : nullptr));
  coded.error = found.error;
  if (points != nullptr) StateErrors(found.error, &coded.metadata);
  coded.metadata.folds = found.folds;
  StateShares(ShareOfSource(HeightSource::kFilled, found.source_counts),
              ShareOfSource(HeightSource::kSmoothed, found.source_counts), &coded.metadata);
  RILIEVO_RETURN_IF_ERROR(ReplaceMetadata(coded.metadata, coded.encoded));
  return coded;
}

absl::Status HelpToCode(const StoredSurface& surface, const PartCutter& cutter, PointPages* points,
                        double position_step, const BlockSize& block, SharedParts* shared,
                        const ReconstructOptions& options, const PipelineContext& context) {
  if (!options.measure) points = nullptr;
  const StoredCoding coding(surface, cutter, points, block, shared, options, context);
  RILIEVO_RETURN_IF_ERROR(coding.Help(position_step));
  if (points == nullptr) return absl::OkStatus();
  CodedStoredSurface coded;
  PartsOfStep step = StepOfCoding(coding, &coded);
  step.make = [](int /*part*/,
                 const RunContext& /*context*/) -> absl::StatusOr<std::vector<uint8_t>> {
    return absl::InternalError("one who helps was to code the surface");
  };
  RILIEVO_RETURN_IF_ERROR(RunParts(step, {[](double /*share*/) {}, shared}, context));
  return coding.MeasureBytes(coded.encoded.Concatenate(), shared).status();
}

absl::StatusOr<PartsError> MeasureDssByParts(std::span<const uint8_t> dss, const PartSizes& sizes,
                                             PointPages* points, const ReconstructOptions& options,
                                             const PipelineContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, true));
  const StoredSurface surface{file.header.frame, file.mesh, file.header.max_level};
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(file.mesh, file.topology));
  const bool in_groups =
      file.header.group_limit > 0 && file.layers.size() > static_cast<size_t>(kFirstGroupedLevel);
  const BlockSize block{sizes.block_vertices, sizes.part_points, in_groups};
  return StoredCoding(surface, cutter, points, block, nullptr, options, context).MeasureBytes(dss);
}

}  // namespace rilievo
