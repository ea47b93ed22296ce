#include "core/pipeline/heights_in_parts.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/run_concurrently.h"
#include "core/base/status_macros.h"
#include "core/loop/face_vertices.h"
#include "core/loop/refinement.h"
#include "core/pipeline/compact_parts.h"
#include "core/pipeline/measure_faces.h"
#include "core/pipeline/settings.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

// Points by control face.
struct PointsOfFaces {
  std::vector<size_t> begin;  // face f has the places [begin[f], begin[f + 1])
  std::vector<int> points;    // ascending for each face
  bool AreOn(int face) const { return begin[face] < begin[face + 1]; }
};

// Beside the faces that touch a part.
int RingsAround(int level) { return std::max(0, (kHeightsInParts.edges_around >> level) - 1); }

// A part with the faces without points that adjoin it, as far as kHeightsInParts.bare_rings of
// them, so that all parts around a hole that is no wider see the same of it. Ascending.
std::vector<int> WithBareFaces(const MeshTopology& topology, const PointsOfFaces& points,
                               const std::vector<int>& part) {
  std::vector<int> all = part, front = part, next;
  std::vector<uint8_t> taken(topology.face_count(), 0);
  for (const int f : part) taken[f] = 1;
  for (int ring = 0; ring < kHeightsInParts.bare_rings && !front.empty();
       ++ring, front.swap(next)) {
    next.clear();
    for (const int f : front) {
      for (const int neighbor : topology.face_neighbors.col(f)) {
        if (neighbor < 0 || taken[neighbor] != 0 || points.AreOn(neighbor)) continue;
        taken[neighbor] = 1;
        next.push_back(neighbor);
      }
    }
    all.insert(all.end(), next.begin(), next.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

// Each point is with the nearest face; of several near it, with the nearest whose normal agrees.
absl::StatusOr<std::vector<int>> FaceOfEach(const OrientedCloud& cloud, const ControlMesh& mesh,
                                            const DisplacementOptions& options,
                                            const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineToVertices(mesh, kHeightsInParts.search_level, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const LimitSurface limit,
      EvaluateLimit(refinement, mesh.vertices, kHeightsInParts.search_level, context));
  const Eigen::Matrix3Xi triangles = FinestFaces(refinement);
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Over(limit.positions, triangles, context,
                                                  1 << (2 * kHeightsInParts.search_level)));
  const auto agrees = [&](int64_t point, int item) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (const int v : triangles.col(tree.source()[item])) normal += limit.normals.col(v);
    return normal.normalized().dot(cloud.normals.col(point)) > options.min_normal_agreement;
  };
  std::vector<int> face(static_cast<size_t>(cloud.points.cols()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(cloud.points.cols(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t p = begin; p < end; ++p) {
          const Eigen::Vector3d point = cloud.points.col(p);
          int item = hint = tree.Closest(point, hint).item;
          if (!agrees(p, item)) {
            std::array<ClosestPointTree::Hit, 8> hits;
            const int found = tree.Nearest(point, hits);
            const auto* agreeing =
                std::find_if(hits.begin(), hits.begin() + found,
                             [&](const ClosestPointTree::Hit& hit) { return agrees(p, hit.item); });
            if (agreeing != hits.begin() + found) item = agreeing->item;
          }
          face[p] = tree.source()[item] >> (2 * kHeightsInParts.search_level);
        }
      }));
  return face;
}

PointsOfFaces SortedByFace(const std::vector<int>& face, int64_t faces) {
  PointsOfFaces sorted{std::vector<size_t>(static_cast<size_t>(faces) + 1, 0),
                       std::vector<int>(face.size())};
  for (const int f : face) ++sorted.begin[f + 1];
  for (size_t f = 0; f + 1 < sorted.begin.size(); ++f) sorted.begin[f + 1] += sorted.begin[f];
  std::vector<size_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  for (size_t p = 0; p < face.size(); ++p) sorted.points[next[face[p]]++] = static_cast<int>(p);
  return sorted;
}

// In the order of the whole cloud.
OrientedCloud CloudOf(const std::vector<int>& faces, const PointsOfFaces& of_faces,
                      const OrientedCloud& whole) {
  std::vector<int> points;
  for (const int f : faces) {
    points.insert(points.end(), of_faces.points.begin() + of_faces.begin[f],
                  of_faces.points.begin() + of_faces.begin[f + 1]);
  }
  std::sort(points.begin(), points.end());
  OrientedCloud cloud;
  cloud.points = whole.points(Eigen::all, points);
  cloud.normals = whole.normals(Eigen::all, points);
  for (const int p : points) {
    cloud.spacing.push_back(whole.spacing[p]);
    cloud.noise.push_back(whole.noise[p]);
  }
  cloud.sharp_lines = whole.sharp_lines;
  cloud.share_of_spacing = whole.share_of_spacing;
  cloud.median_spacing = whole.median_spacing;
  cloud.median_noise = whole.median_noise;
  return cloud;
}

struct HeightsOfPart {
  HeightsOfFaces found;
  double points = 0;
};

void PutInto(const HeightsOfFaces& found, const std::vector<int>& faces, const FaceVertices& whole,
             DisplacementField* field) {
  size_t next = 0;
  std::vector<int> of_face;
  for (const int f : faces) {
    whole.Of(f, of_face);
    for (const int v : of_face) {
      field->heights[v] = found.heights[next];
      field->source[v] = found.sources[next++];
    }
  }
}

}  // namespace

absl::StatusOr<DisplacementField> MeasureHeightsInParts(
    const OrientedCloud& cloud, const ControlMesh& mesh, const PartCutter& cutter, int level,
    int64_t part_vertices, const DisplacementOptions& options, const RunContext& context) {
  const MeshTopology& topology = cutter.topology();
  const int64_t vertices = VertexCountAt(topology, level), faces = topology.face_count();
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> face, FaceOfEach(cloud, mesh, options, context));
  const PointsOfFaces of_faces = SortedByFace(face, faces);
  const std::vector<std::vector<int>> parts =
      CompactParts(mesh, topology, std::max<int64_t>(1, part_vertices * faces / vertices));
  RunContext silent = context;
  silent.progress = nullptr;
  const auto measure = [&](size_t part, HeightsOfPart* measured) -> absl::Status {
    if (part >= parts.size()) return absl::OkStatus();
    const SubMesh sub =
        cutter.Cut(WithBareFaces(topology, of_faces, parts[part]), RingsAround(level));
    const OrientedCloud near = CloudOf(sub.faces, of_faces, cloud);
    measured->points = static_cast<double>(near.points.cols());
    RILIEVO_ASSIGN_OR_RETURN(measured->found, MeasureFaces(sub, PlacesOf(parts[part], sub.faces),
                                                           near, level, options, silent));
    return absl::OkStatus();
  };
  DisplacementField field;
  field.heights.resize(static_cast<size_t>(vertices));
  field.source.resize(static_cast<size_t>(vertices));
  const FaceVertices whole(topology, level);
  double leverage = 0, points = 0;
  // Two at a time, for not all of a part's work is for several threads.
  for (size_t part = 0; part < parts.size(); part += 2) {
    context.Report(Stage::kDisplacement,
                   static_cast<double>(part) / static_cast<double>(parts.size()));
    std::array<HeightsOfPart, 2> both;
    RILIEVO_RETURN_IF_ERROR(RunConcurrently(
        silent, [&] { return measure(part, &both[0]); },
        [&] { return measure(part + 1, &both[1]); }));
    for (size_t k = 0; k < both.size() && part + k < parts.size(); ++k) {
      PutInto(both[k].found, parts[part + k], whole, &field);
      leverage += both[k].points * both[k].found.leverage;
      points += both[k].points;
    }
  }
  CountSources(&field);
  field.leverage = points > 0 ? leverage / points : 1;
  return field;
}

}  // namespace rilievo
