#include "core/pipeline/heights_from_pages.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/displacement/sample_displacement.h"
#include "core/loop/face_vertices.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/loop/sub_mesh.h"
#include "core/paging/part_journal.h"

namespace rilievo {
namespace {

// Some control faces with all that their heights depend on.
struct Part {
  SubMesh sub;
  std::vector<int> inner;  // faces of `sub` that are the part itself, ascending
};

absl::Status WritePart(const Part& part, const FaceVertices& vertices,
                       const DisplacementField& field, ScratchHeights* heights) {
  std::vector<int> of_face;
  std::vector<float> of_vertex;
  std::vector<HeightSource> sources;
  for (const int f : part.inner) {
    vertices.Of(f, of_face);
    of_vertex.clear();
    sources.clear();
    for (const int v : of_face) {
      of_vertex.push_back(field.heights[v]);
      sources.push_back(field.source[v]);
    }
    RILIEVO_RETURN_IF_ERROR(heights->Write(part.sub.faces[f], of_vertex, sources));
  }
  return absl::OkStatus();
}

DisplacementField NoHeights(int64_t vertices) {
  DisplacementField field;
  field.heights.assign(static_cast<size_t>(vertices), 0.0f);
  field.source.assign(static_cast<size_t>(vertices), HeightSource::kFilled);
  return field;
}

absl::Status MeasureFaces(const Part& part, const OrientedCloud& cloud, int level,
                          const DisplacementOptions& options, const RunContext& context,
                          ScratchHeights* heights) {
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
  return WritePart(part, FaceVertices(refinement.levels.front(), level), field, heights);
}

// Parts that an earlier run has finished, and whose heights are as they were.
std::set<int> PartsThatAreThere(const PartJournal& journal, const std::vector<FacePart>& parts,
                                const ScratchHeights& heights) {
  std::set<int> there;
  for (const auto& [part, sum] : journal.finished()) {
    if (part < 0 || static_cast<size_t>(part) >= parts.size()) continue;
    const std::vector<int>& faces = parts[static_cast<size_t>(part)].faces;
    if (std::all_of(faces.begin(), faces.end(), [&](int face) { return heights.Has(face); })) {
      there.insert(part);
    }
  }
  return there;
}

}  // namespace

absl::StatusOr<ScratchHeights> MeasureHeightsFromPages(const KnownPoints& points,
                                                       const FaceParts& parts,
                                                       const PartCutter& cutter, int level,
                                                       const DisplacementOptions& options,
                                                       const std::function<void(double)>& told,
                                                       const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchHeights heights,
      ScratchHeights::Create(points.scan.scratch_folder(), cutter.topology(), level));
  RILIEVO_ASSIGN_OR_RETURN(PartJournal journal,
                           PartJournal::Open(points.scan.scratch_folder(), "parts"));
  const std::set<int> there = PartsThatAreThere(journal, parts.parts(), heights);
  size_t done = there.size();
  for (size_t p = 0; p < parts.parts().size(); ++p) {
    told(static_cast<double>(done) / static_cast<double>(parts.parts().size()));
    if (there.count(static_cast<int>(p)) != 0) continue;
    const FacePart& face_part = parts.parts()[p];
    RILIEVO_ASSIGN_OR_RETURN(const OrientedCloud cloud, CloudIn(face_part.box, points, context));
    Part part{cutter.Cut(parts.FacesIn(face_part.box), 0), {}};
    part.inner = PlacesOf(face_part.faces, part.sub.faces);
    RILIEVO_RETURN_IF_ERROR(MeasureFaces(part, cloud, level, options, context, &heights));
    RILIEVO_RETURN_IF_ERROR(journal.Add(static_cast<int>(p), 0));
    ReleaseToOsAfter(points.scan.size());
    ++done;
  }
  RILIEVO_RETURN_IF_ERROR(heights.Finish());
  return heights;
}

}  // namespace rilievo
