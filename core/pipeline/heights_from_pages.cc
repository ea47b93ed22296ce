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
#include "core/loop/sub_mesh.h"
#include "core/pipeline/measure_faces.h"

namespace rilievo {
namespace {

template <typename Archive, typename Heights>
void VisitHeights(Archive& archive, Heights& of_part) {
  archive(of_part.heights);
  archive(of_part.sources);
}

bool AreHeights(const HeightsOfFaces& found, size_t count) {
  return found.heights.size() == count && found.sources.size() == count &&
         AreSources(found.sources) &&
         std::all_of(found.heights.begin(), found.heights.end(),
                     [](float height) { return std::isfinite(height); });
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
    const SubMesh sub = cutter.Cut(parts.FacesIn(face_part.box), 0);
    RILIEVO_ASSIGN_OR_RETURN(
        const HeightsOfFaces found,
        MeasureFaces(sub, PlacesOf(face_part.faces, sub.faces), cloud, level, options, own));
    ValueWriter writer;
    VisitHeights(writer, found);
    return std::move(writer.bytes);
  };
  of_step.take = [&](int number, std::span<const uint8_t> bytes) -> absl::Status {
    const std::vector<int>& faces = parts.parts()[number].faces;
    HeightsOfFaces found;
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
