#include "core/pipeline/heights_from_pages.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
#include "core/displacement/sample_displacement.h"
#include "core/loop/face_vertices.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

// Some control faces with all that their heights depend on.
struct Part {
  SubMesh sub;
  std::vector<int> inner;  // faces of `sub` that are the part itself, ascending
};

// Of all vertices of the part's faces, face by face.
struct HeightsOfPart {
  std::vector<float> heights;
  std::vector<HeightSource> sources;
};

template <typename Archive, typename Heights>
void VisitHeights(Archive& archive, Heights& of_part) {
  archive(of_part.heights);
  archive(of_part.sources);
}

HeightsOfPart HeightsOf(const Part& part, const FaceVertices& vertices,
                        const DisplacementField& field) {
  HeightsOfPart found;
  std::vector<int> of_face;
  for (const int f : part.inner) {
    vertices.Of(f, of_face);
    for (const int v : of_face) {
      found.heights.push_back(field.heights[v]);
      found.sources.push_back(field.source[v]);
    }
  }
  return found;
}

bool AreHeights(const HeightsOfPart& found, size_t count) {
  return found.heights.size() == count && found.sources.size() == count &&
         AreSources(found.sources) &&
         std::all_of(found.heights.begin(), found.heights.end(),
                     [](float height) { return std::isfinite(height); });
}

DisplacementField NoHeights(int64_t vertices) {
  DisplacementField field;
  field.heights.assign(static_cast<size_t>(vertices), 0.0f);
  field.source.assign(static_cast<size_t>(vertices), HeightSource::kFilled);
  return field;
}

absl::StatusOr<HeightsOfPart> MeasureFaces(const Part& part, const OrientedCloud& cloud, int level,
                                           const DisplacementOptions& options,
                                           const RunContext& context) {
  const ControlMesh& mesh = part.sub.mesh;
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement, RefineToVertices(mesh, level, context));
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                           EvaluateLimit(refinement, mesh.vertices, level, context));
  DisplacementField field = NoHeights(limit.positions.cols());
  if (cloud.points.cols() > 0) {
    const VertexRings control_rings = BuildVertexRings(refinement.levels.front());
    const LevelRings rings =
        level == 0 ? LevelRings(control_rings) : LevelRings::After(refinement.levels[level - 1]);
    RILIEVO_ASSIGN_OR_RETURN(field,
                             SampleDisplacement(cloud, refinement, rings, limit, options, context));
  }
  return HeightsOf(part, FaceVertices(refinement.levels.front(), level), field);
}

}  // namespace

absl::StatusOr<ScratchHeights> MeasureHeightsFromPages(
    const KnownPoints& points, const FaceParts& parts, const PartCutter& cutter, int level,
    const DisplacementOptions& options, const PartsRun& run, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchHeights heights,
      ScratchHeights::Create(points.scan.scratch_folder(), cutter.topology(), level));
  PartsOfStep of_step{.step = PartStep::kHeights, .count = static_cast<int>(parts.parts().size())};
  of_step.is_there = [&](int part) {
    const std::vector<int>& faces = parts.parts()[part].faces;
    return std::all_of(faces.begin(), faces.end(), [&](int face) { return heights.Has(face); });
  };
  of_step.make = [&](int number, const RunContext& own) -> absl::StatusOr<std::vector<uint8_t>> {
    const FacePart& face_part = parts.parts()[number];
    RILIEVO_ASSIGN_OR_RETURN(const OrientedCloud cloud, CloudIn(face_part.box, points, own));
    Part part{cutter.Cut(parts.FacesIn(face_part.box), 0), {}};
    part.inner = PlacesOf(face_part.faces, part.sub.faces);
    RILIEVO_ASSIGN_OR_RETURN(const HeightsOfPart found,
                             MeasureFaces(part, cloud, level, options, own));
    ValueWriter writer;
    VisitHeights(writer, found);
    return std::move(writer.bytes);
  };
  of_step.take = [&](int number, std::span<const uint8_t> bytes) -> absl::Status {
    const std::vector<int>& faces = parts.parts()[number].faces;
    HeightsOfPart found;
    ValueReader reader(bytes);
    VisitHeights(reader, found);
    const size_t each = heights.vertices_of_face();
    if (!reader.Finished() || !AreHeights(found, faces.size() * each)) {
      return NotOfPart(PartStep::kHeights, number);
    }
    for (size_t f = 0; f < faces.size(); ++f) {
      const auto at = static_cast<std::ptrdiff_t>(f * each);
      const auto end = at + static_cast<std::ptrdiff_t>(each);
      RILIEVO_RETURN_IF_ERROR(
          heights.Write(faces[f], {found.heights.begin() + at, found.heights.begin() + end},
                        {found.sources.begin() + at, found.sources.begin() + end}));
    }
    ReleaseToOsAfter(points.scan.size());
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunParts(of_step, run, context));
  RILIEVO_RETURN_IF_ERROR(heights.Finish());
  return heights;
}

}  // namespace rilievo
