#include "core/evaluate/quad_evaluator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/evaluate/limit_evaluator.h"
#include "core/loop/refinement.h"
#include "core/loop/sub_mesh.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Nearer to an irregular vertex than this, in lengths of a quad, the surface is taken at it.
constexpr double kAtQuadCorner = 0x1p-48;

// That take about as much memory as a cell.
constexpr int64_t kPatchesOfCell = 4;

constexpr std::array<std::array<double, 2>, 4> kCornerPlaces = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

// The quarter that holds (s, t), and where there.
int DescendIntoQuarter(double& s, double& t) {
  const bool right = s >= 0.5, upper = t >= 0.5;
  s = 2 * s - (right ? 1 : 0);
  t = 2 * t - (upper ? 1 : 0);
  return upper ? (right ? 2 : 3) : (right ? 1 : 0);
}

// What the chain rule makes of a jet whose parameters grow `scale` times as fast.
void ScaleQuadJet(double scale, JetOrder order, SurfaceJet& jet) {
  if (order >= JetOrder::kFirst) {
    jet.u *= scale;
    jet.v *= scale;
  }
  if (order >= JetOrder::kSecond) {
    jet.uu *= scale * scale;
    jet.uv *= scale * scale;
    jet.vv *= scale * scale;
  }
}

SurfaceJet JetOfCorner(const QuadSurroundings::Corner& corner) {
  SurfaceJet jet;
  jet.irregular = true;
  jet.position = corner.position;
  jet.u = corner.tangent_u;
  jet.v = corner.tangent_v;
  jet.uu.setConstant(std::numeric_limits<double>::quiet_NaN());
  jet.uv = jet.vv = jet.uu;
  return jet;
}

// Cuts on until (s, t) lies in a regular quarter.
SurfaceJet AtCell(ControlMesh mesh, QuadPart part, double s, double t, JetOrder order) {
  Vector3d origin = Vector3d::Zero();
  double scale = 1;
  while (true) {
    const Vector3d first = mesh.vertices.col(mesh.faces(0, part.face));
    mesh.vertices.colwise() -= first;
    origin += first;
    RunContext alone;
    alone.threads = 1;
    // It is part of a mesh that has been refined before.
    const LoopRefinement refinement = *RefineTopology(mesh, 1, alone);
    part = ChildOf(refinement, part, DescendIntoQuarter(s, t));
    scale *= 2;
    const Eigen::Matrix3Xd points = SubdivideOnce(refinement, 0, mesh.vertices);
    const QuadSurroundings finer(refinement, 1, points);
    if (const std::optional<QuadGrid> grid = finer.GridOf(part)) {
      SurfaceJet jet;
      BicubicPatch::Over(*grid).Evaluate(s, t, order, jet);
      jet.position += origin;
      ScaleQuadJet(scale, order, jet);
      return jet;
    }
    std::vector<int> face_place(refinement.levels[1].face_count(), -1);
    mesh = finer.CutOut(&part, &face_place);
  }
}

}  // namespace

class QuadTreeBuilder {
 public:
  QuadTreeBuilder(const ControlMesh& mesh, const RunContext& context)
      : mesh_(mesh), context_(context) {}

  absl::StatusOr<QuadEvaluator> Run() {
    RILIEVO_ASSIGN_OR_RETURN(refinement_, RefineTopology(mesh_, 0, context_));
    points_ = mesh_.vertices;
    level_ = 0;
    StartWithControlQuads();
    for (int depth = 0; !parts_.empty(); ++depth) {
      RILIEVO_RETURN_IF_ERROR(Take(depth));
      // At most: each quarter of a part is a patch, or a cell in the end.
      const int64_t each = depth + 1 < QuadEvaluator::kCutLevels ? 4 : 4 * kPatchesOfCell;
      RILIEVO_RETURN_IF_ERROR(LimitEvaluator::CheckPatchCount(
          static_cast<int64_t>(made_.patches_.size()) + each * static_cast<int64_t>(parts_.size()),
          mesh_.faces.cols()));
      RILIEVO_RETURN_IF_ERROR(CutOn());
    }
    return std::move(made_);
  }

 private:
  // A quad of the level, and where its code goes: ~q for control quad q, else 4 n + c for child c
  // of node n.
  struct Part {
    QuadPart quad;
    int64_t place;
  };

  void StartWithControlQuads() {
    const MeshTopology& topology = refinement_.levels[0];
    const QuadLevel& quads = refinement_.quads.levels[0];
    made_.faces_.resize(topology.face_count());
    const QuadSurroundings surroundings(refinement_, 0, points_);
    for (int f = 0; f < topology.face_count(); ++f) {
      const Quad quad = QuadOfFace(topology, quads, f);
      if (topology.edge_faces(0, quad.diagonal) != f) continue;
      for (int half = 0; half < 2; ++half) {
        const int face = topology.edge_faces(half, quad.diagonal);
        made_.faces_[face].quad = static_cast<int>(parts_.size());
        for (int k = 0; k < 3; ++k) {
          const auto place =
              std::find(quad.vertices.begin(), quad.vertices.end(), topology.faces(k, face));
          made_.faces_[face].corners[k] = static_cast<uint8_t>(place - quad.vertices.begin());
        }
      }
      QuadEvaluator::ControlQuad& control = made_.quads_.emplace_back();
      for (int corner = 0; corner < 4; ++corner) {
        const QuadPart whole = {f, 0};
        const bool irregular = surroundings.IsIrregular(whole, corner);
        control.limits[corner] = irregular ? static_cast<int32_t>(made_.limits_.size()) : -1;
        if (irregular) made_.limits_.push_back(surroundings.LimitAt(whole, corner));
      }
      parts_.push_back({{f, 0}, ~static_cast<int64_t>(parts_.size())});
    }
  }

  // Makes a patch or a cell of each part, or a node whose children are parts of the next level.
  absl::Status Take(int depth) {
    const QuadSurroundings surroundings(refinement_, level_, points_);
    std::vector<int> face_place(refinement_.levels[level_].face_count(), -1);
    std::vector<Part> cut;
    for (size_t i = 0; i < parts_.size(); ++i) {
      if (i % kHeavyBlock == 0) RILIEVO_RETURN_IF_ERROR(context_.CheckStop());
      const Part& part = parts_[i];
      if (const std::optional<QuadGrid> grid = surroundings.GridOf(part.quad)) {
        Put(part.place, ~static_cast<int32_t>(2 * made_.patches_.size()));
        made_.patches_.push_back(BicubicPatch::Over(*grid));
      } else if (depth == QuadEvaluator::kCutLevels) {
        Put(part.place, ~static_cast<int32_t>(2 * made_.cells_.size() + 1));
        QuadEvaluator::Cell& cell = made_.cells_.emplace_back();
        cell.part = part.quad;
        cell.mesh = surroundings.CutOut(&cell.part, &face_place);
      } else {
        Put(part.place, static_cast<int32_t>(made_.nodes_.size()));
        cut.push_back({part.quad, 4 * static_cast<int64_t>(made_.nodes_.size())});
        made_.nodes_.push_back({});
      }
    }
    parts_ = std::move(cut);
    return absl::OkStatus();
  }

  void Put(int64_t place, int32_t code) {
    if (place < 0) {
      made_.quads_[~place].root = code;
    } else {
      made_.nodes_[place / 4][place % 4] = code;
    }
  }

  // The next level of the quads that are cut, and their quarters as parts.
  absl::Status CutOn() {
    if (parts_.empty()) return absl::OkStatus();
    const MeshTopology& topology = refinement_.levels[level_];
    const QuadLevel& quads = refinement_.quads.levels[level_];
    std::vector<uint8_t> wanted(topology.face_count(), 0);
    for (const Part& part : parts_) wanted[part.quad.face] = 1;
    std::vector<SharpEdge> sharp;
    for (int e = 0; e < topology.edge_count(); ++e) {
      if (quads.sharpness[e] > 0) sharp.push_back({e, quads.sharpness[e]});
    }
    const SubMesh sub =
        CutFacesOut(topology, points_, wanted, sharp, refinement_.quads.corners, quads.diagonal);
    std::vector<int> place(topology.face_count(), -1);
    for (size_t i = 0; i < sub.faces.size(); ++i) place[sub.faces[i]] = static_cast<int>(i);
    RILIEVO_ASSIGN_OR_RETURN(LoopRefinement finer, RefineTopology(sub.mesh, 1, context_));
    std::vector<Part> quarters;
    for (const Part& part : parts_) {
      const QuadPart parent = {place[part.quad.face], part.quad.turn};
      for (int child = 0; child < 4; ++child) {
        quarters.push_back({ChildOf(finer, parent, child), part.place + child});
      }
    }
    points_ = SubdivideOnce(finer, 0, sub.mesh.vertices);
    refinement_ = std::move(finer);
    level_ = 1;
    parts_ = std::move(quarters);
    return absl::OkStatus();
  }

  const ControlMesh& mesh_;
  const RunContext& context_;
  QuadEvaluator made_;
  LoopRefinement refinement_;
  int level_ = 0;  // of it
  Eigen::Matrix3Xd points_;
  std::vector<Part> parts_;
};

absl::StatusOr<QuadEvaluator> QuadEvaluator::Build(const ControlMesh& mesh,
                                                   const RunContext& context) {
  return QuadTreeBuilder(mesh, context).Run();
}

int32_t QuadEvaluator::CornerAt(const ControlQuad& quad, double s, double t) const {
  for (size_t i = 0; i < 4; ++i) {
    if (quad.limits[i] >= 0 && std::abs(s - kCornerPlaces[i][0]) < kAtQuadCorner &&
        std::abs(t - kCornerPlaces[i][1]) < kAtQuadCorner) {
      return quad.limits[i];
    }
  }
  return -1;
}

SurfaceJet QuadEvaluator::AtQuad(const PatchPlace& place, JetOrder order) const {
  if (place.code >= 0) return JetOfCorner(limits_[place.code]);
  const size_t leaf = static_cast<size_t>(~place.code);
  SurfaceJet jet;
  if (leaf % 2 == 0) {
    patches_[leaf / 2].Evaluate(place.u, place.v, order, jet);
  } else {
    const Cell& cell = cells_[leaf / 2];
    jet = AtCell(cell.mesh, cell.part, place.u, place.v, order);
  }
  ScaleQuadJet(place.scale, order, jet);
  return jet;
}

QuadEvaluator::Sides QuadEvaluator::SidesOf(const Face& half) const {
  const auto corner = [&](int k) { return Vector2d(kCornerPlaces[half.corners[k]].data()); };
  return {corner(0), corner(1) - corner(0), corner(2) - corner(0)};
}

PatchPlace QuadEvaluator::Find(int face, double u, double v) const {
  u = std::clamp(u, 0.0, 1.0);
  v = std::clamp(v, 0.0, 1.0 - u);
  const Face& half = faces_[face];
  const Sides sides = SidesOf(half);
  const Vector2d at = (sides.start + u * sides.by_u + v * sides.by_v).cwiseMax(0.0).cwiseMin(1.0);
  const ControlQuad& quad = quads_[half.quad];
  PatchPlace place = {face, CornerAt(quad, at[0], at[1]), at[0], at[1]};
  if (place.code >= 0) return place;
  place.code = quad.root;
  while (place.code >= 0) {
    place.code = nodes_[place.code][DescendIntoQuarter(place.u, place.v)];
    place.scale *= 2;
  }
  const size_t leaf = static_cast<size_t>(~place.code);
  if (leaf % 2 == 0) PrefetchPart(patches_[leaf / 2]);
  return place;
}

SurfaceJet QuadEvaluator::AtPlace(const PatchPlace& place, JetOrder order) const {
  const SurfaceJet in_quad = AtQuad(place, order);
  if (in_quad.irregular) return in_quad;
  const auto [start, by_u, by_v] = SidesOf(faces_[place.face]);
  SurfaceJet jet = in_quad;
  if (order >= JetOrder::kFirst) {
    jet.u = by_u[0] * in_quad.u + by_u[1] * in_quad.v;
    jet.v = by_v[0] * in_quad.u + by_v[1] * in_quad.v;
  }
  if (order >= JetOrder::kSecond) {
    const auto second = [&](const Vector2d& a, const Vector2d& b) -> Vector3d {
      return a[0] * b[0] * in_quad.uu + (a[0] * b[1] + a[1] * b[0]) * in_quad.uv +
             a[1] * b[1] * in_quad.vv;
    };
    jet.uu = second(by_u, by_u);
    jet.uv = second(by_u, by_v);
    jet.vv = second(by_v, by_v);
  }
  return jet;
}

}  // namespace rilievo
