// What the points around a mesh's edges say of them: sharp or smooth.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scan/crease_planes.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

enum class Verdict : uint8_t { kSmooth, kWeak, kStrong };

struct EdgeJudgement {
  Verdict verdict = Verdict::kSmooth;
  std::optional<EdgePlace> place;  // where it was judged, nothing for what was not
  std::optional<CreasePlanes> planes;
};

// An edge between two faces: its ends, the faces' unit normals and the corners opposite to it.
struct FoldedEdge {
  Eigen::Vector3d p, q;
  std::array<Eigen::Vector3d, 2> normals, opposite;
};

// `before`: what was said of the edge earlier, asked again only where it moved; may be null.
EdgeJudgement JudgeEdge(const OrientedCloud& cloud, const PointIndex& index, const FoldedEdge& edge,
                        const EdgeJudgement* before);

// By the ends of the edges, first < second.
using EarlierJudgements = std::map<std::pair<int, int>, EdgeJudgement>;

// One judgement an edge. Edges whose faces meet nearly flat, and those of the boundary, are smooth
// unseen. CANCELLED when stopped.
absl::StatusOr<std::vector<EdgeJudgement>> JudgeEdges(
    const OrientedCloud& cloud, const PointIndex& index, const ControlMesh& mesh,
    const MeshTopology& topology, const EarlierJudgements& earlier, const RunContext& context);

// The corner of `face` that is neither a nor b.
int OppositeCorner(const Eigen::Matrix3Xi& faces, int face, int a, int b);

// Along the face's normal, twice as long as its area.
Eigen::Vector3d FaceCross(const ControlMesh& mesh, int face);

}  // namespace rilievo
