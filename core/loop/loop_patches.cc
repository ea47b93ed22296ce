#include "core/loop/loop_patches.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/limit_normal.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

constexpr int kMostSteps = 4;     // a table of 153 points
constexpr int kMostValence = 32;  // tables grow with it

// The vertices that each step adds on a face are one run. `points`: those of all steps.
void SinkRuns(const PatchNumbering& numbering, int face, std::span<const LimitPoint> points,
              const LimitRun& sink) {
  const PatchLattice& lattice = numbering.lattice();
  for (int step = 0; step < lattice.steps(); ++step) {
    const size_t count = lattice.Added(numbering.MaskOf(face), step).size();
    if (count > 0) sink(numbering.FirstAdded(face, step), points.first(count));
    points = points.subspan(count);
  }
}

}  // namespace

absl::StatusOr<LoopPatches> LoopPatches::Build(const ControlMesh& mesh, int level,
                                               const RunContext& context) {
  if (level < kLeastLevel || level > kMaxLoopLevel) {
    return absl::InvalidArgumentError(absl::StrCat("level is ", level, ", patches serve level ",
                                                   kLeastLevel, " to ", kMaxLoopLevel));
  }
  if (mesh.quads()) return absl::InvalidArgumentError("patches are those of Loop surfaces");
  const int steps = std::min(kMostSteps, level - 1);
  if (mesh.faces.cols() > kMaxLoopFaces >> (2 * level)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("level ", level, " would have more than ", kMaxLoopFaces, " faces"));
  }
  LoopPatches patches;
  RILIEVO_ASSIGN_OR_RETURN(patches.refinement_, RefineTopology(mesh, level - steps, context));
  patches.corners_ = mesh.corners;
  patches.control_points_ = mesh.vertices;
  patches.base_points_ = mesh.vertices;
  for (int l = 0; l < level - steps; ++l) {
    patches.base_points_ = SubdivideOnce(patches.refinement_, l, patches.base_points_);
  }
  patches.squared_noise_ = SquaredTangentNoise(mesh.vertices);
  patches.lattice_ = std::make_unique<PatchLattice>(steps);
  patches.numbering_ = std::make_unique<PatchNumbering>(patches.base(), *patches.lattice_);
  patches.MarkIrregularFaces(mesh);
  RILIEVO_RETURN_IF_ERROR(patches.BuildTables());
  return patches;
}

void LoopPatches::MarkIrregularFaces(const ControlMesh& mesh) {
  const MeshTopology& topology = base();
  std::vector<uint8_t> irregular_vertex = topology.boundary_vertex;
  for (int v = 0; v < static_cast<int>(mesh.vertices.cols()); ++v) {
    irregular_vertex[v] |= topology.valence[v] < 3 || topology.valence[v] > kMostValence;
  }
  if (!refinement_.sharp.empty()) {
    for (int v : refinement_.sharp.levels.back().vertices) irregular_vertex[v] = 1;
  }
  irregular_.resize(topology.face_count());
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) irregular_[f] |= irregular_vertex[topology.faces(k, f)];
  }
}

absl::Status LoopPatches::BuildTables() {
  tables_.resize(kMostValence + 1);
  const MeshTopology& topology = base();
  for (int f = 0; f < topology.face_count(); ++f) {
    if (irregular_[f]) continue;
    int valence = 6;
    for (int k = 0; k < 3; ++k) {
      if (topology.valence[topology.faces(k, f)] != 6) {
        valence = topology.valence[topology.faces(k, f)];
      }
    }
    if (tables_[valence]) continue;
    RILIEVO_ASSIGN_OR_RETURN(tables_[valence], PatchTable::Build(valence, *lattice_));
  }
  return absl::OkStatus();
}

bool LoopPatches::EvaluateFace(int face, std::vector<int>& ring,
                               std::vector<std::array<double, 3>>& points,
                               std::vector<PatchSample>& samples, std::vector<LimitPoint>& run,
                               const LimitRun& sink) const {
  int first = 0;
  for (int k = 1; k < 3; ++k) {
    if (base().valence[base().faces(k, face)] != 6) first = k;
  }
  PatchRing(base(), face, first, ring);
  points.clear();
  for (int v : ring) points.push_back({base_points_(0, v), base_points_(1, v), base_points_(2, v)});
  const PatchTable& table = *tables_[base().valence[ring[0]]];
  const int mask = numbering_->MaskOf(face);
  table.Evaluate(PatchTable::kInterior, points, samples);
  for (int side = 0; side < 3; ++side) {
    if ((mask >> side & 1) == 0) continue;
    table.Evaluate(static_cast<PatchTable::Group>((side + 3 - first) % 3), points, samples);
  }
  const std::vector<int>& back = lattice_->Turned((3 - first) % 3);
  const auto normal = [&](const PatchSample& sample, Eigen::Vector3d& result) {
    return NormalFromTangents(Eigen::Vector3d(sample[3], sample[4], sample[5]),
                              Eigen::Vector3d(sample[6], sample[7], sample[8]), squared_noise_,
                              result);
  };
  run.clear();
  for (int step = 0; step < lattice_->steps(); ++step) {
    for (int point : lattice_->Added(mask, step)) {
      const PatchSample& sample = samples[back[point]];
      LimitPoint& limit = run.emplace_back();
      limit.position = {sample[0], sample[1], sample[2]};
      if (!normal(sample, limit.normal)) return false;
    }
  }
  SinkRuns(*numbering_, face, run, sink);
  return true;
}

absl::Status LoopPatches::Evaluate(const RunContext& context, const LimitRun& sink) const {
  {
    RILIEVO_ASSIGN_OR_RETURN(
        const LimitSurface limit,
        EvaluateLimit(refinement_, control_points_, refinement_.max_level(), context));
    std::vector<LimitPoint> run;
    run.reserve(limit.positions.cols());
    for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
      run.push_back({limit.positions.col(v), limit.normals.col(v)});
    }
    sink(0, run);
  }
  std::vector<uint8_t> left = irregular_;
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(base().face_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
        std::vector<int> ring;
        std::vector<std::array<double, 3>> points;
        std::vector<PatchSample> samples(lattice_->point_count());
        std::vector<LimitPoint> run;
        for (int f = static_cast<int>(begin); f < static_cast<int>(end); ++f) {
          if (irregular_[f] == 0) left[f] = !EvaluateFace(f, ring, points, samples, run, sink);
        }
      }));
  return EvaluateCommonWay(left, context, sink);
}

absl::Status LoopPatches::EvaluateCommonWay(const std::vector<uint8_t>& faces,
                                            const RunContext& context, const LimitRun& sink) const {
  if (std::find(faces.begin(), faces.end(), 1) == faces.end()) return absl::OkStatus();
  const std::vector<SharpEdge> none;
  const SubMesh sub = CutFacesOut(
      base(), base_points_, faces,
      refinement_.sharp.empty() ? none : refinement_.sharp.levels.back().edges, corners_);
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(sub.mesh, lattice_->steps() - 1, context));
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit, EvaluateLimit(refinement, sub.mesh.vertices,
                                                                   lattice_->steps(), context));
  const PatchNumbering numbering(refinement.levels.front(), *lattice_);
  return ParallelFor(
      static_cast<int64_t>(sub.faces.size()), kHeavyBlock, context,
      [&](int64_t begin, int64_t end) {
        std::vector<int> vertices;
        std::vector<LimitPoint> run;
        for (int64_t f = begin; f < end; ++f) {
          if (faces[sub.faces[f]] == 0) continue;
          numbering.VerticesOf(static_cast<int>(f), vertices);
          run.clear();
          for (int step = 0; step < lattice_->steps(); ++step) {
            for (int point : lattice_->Added(numbering_->MaskOf(sub.faces[f]), step)) {
              const int v = vertices[point];
              run.push_back({limit.positions.col(v), limit.normals.col(v)});
            }
          }
          SinkRuns(*numbering_, sub.faces[f], run, sink);
        }
      });
}

}  // namespace rilievo
