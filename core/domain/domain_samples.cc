#include "core/domain/domain_samples.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <utility>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/loop/quad_topology.h"

namespace rilievo {
namespace {

void AssignOwners(const FaceSamples& face_samples, int sample_count, DomainSamples* samples) {
  std::vector<uint8_t> taken(static_cast<size_t>(sample_count), 0);
  samples->owned.reserve(static_cast<size_t>(sample_count));
  samples->owned_begin.assign(1, 0);
  const int faces = samples->control_face_count();
  for (int face = 0; face < faces; ++face) {
    for (int k = 0; k < face_samples.per_face; ++k) {
      const int sample =
          face_samples.vertices[static_cast<size_t>(face) * face_samples.per_face + k];
      if (taken[static_cast<size_t>(sample)]) continue;
      taken[static_cast<size_t>(sample)] = 1;
      samples->owned.push_back(sample);
    }
    samples->owned_begin.push_back(static_cast<int>(samples->owned.size()));
  }
}

void LinkBoundary(const MeshTopology& topology, DomainSamples* samples) {
  samples->boundary_previous.assign(static_cast<size_t>(topology.vertex_count), -1);
  samples->boundary_next.assign(static_cast<size_t>(topology.vertex_count), -1);
  for (int face = 0; face < topology.face_count(); ++face) {
    for (int k = 0; k < 3; ++k) {
      if (topology.face_neighbors(k, face) >= 0) continue;
      const int from = topology.faces(k, face);
      const int to = topology.faces((k + 1) % 3, face);
      samples->boundary_next[static_cast<size_t>(from)] = to;
      samples->boundary_previous[static_cast<size_t>(to)] = from;
    }
  }
}

void ListSharp(DomainSamples* samples) {
  const std::vector<int>& vertices = samples->stencils.sectors.vertices;
  if (vertices.empty()) return;
  samples->sharp_slot.assign(static_cast<size_t>(samples->size()), -1);
  for (size_t side = 0; side < vertices.size(); ++side) {
    if (side > 0 && vertices[side] == vertices[side - 1]) continue;
    samples->sharp_slot[static_cast<size_t>(vertices[side])] =
        static_cast<int>(samples->sharp.size());
    samples->sharp.push_back(vertices[side]);
    samples->side_begin.push_back(static_cast<int>(side));
  }
  samples->side_begin.push_back(static_cast<int>(vertices.size()));
}

Eigen::Matrix3Xd SideNormals(const SectorStencils& sides, const Eigen::Matrix3Xd& control_points) {
  Eigen::Matrix3Xd normals(3, sides.size());
  for (int s = 0; s < sides.size(); ++s) {
    Eigen::Vector3d tangent_u = Eigen::Vector3d::Zero(), tangent_v = Eigen::Vector3d::Zero();
    for (int e = sides.begin[s]; e < sides.begin[s + 1]; ++e) {
      const auto point = control_points.col(sides.control_vertices[e]);
      tangent_u += sides.tangent_u[e] * point;
      tangent_v += sides.tangent_v[e] * point;
    }
    normals.col(s) = tangent_u.cross(tangent_v).normalized();
  }
  return normals;
}

// Of quads: neighbours along edges, and with the corners opposite to them.
void ListQuadRings(DomainSamples* samples) {
  const QuadRings rings(samples->refinement.levels.front(), samples->refinement.quads, 0);
  VertexRings& all = samples->control_rings;
  VertexRings& edges = samples->quad_edges;
  all = {{0}, {}};
  edges = {{0}, {}};
  QuadRing ring;
  for (int v = 0; v < samples->control_vertex_count(); ++v) {
    rings.Of(v, ring);
    for (VertexRings* list : {&edges, &all}) {
      list->neighbors.insert(list->neighbors.end(), ring.neighbors.begin(), ring.neighbors.end());
    }
    all.neighbors.insert(all.neighbors.end(), ring.opposite.begin(), ring.opposite.end());
    for (VertexRings* list : {&edges, &all}) {
      list->neighbor_begin.push_back(static_cast<int>(list->neighbors.size()));
    }
  }
}

// Drops what nobody asks of a finest level beyond the control mesh once its rings are known.
void LeaveFaces(LoopRefinement* refinement) {
  if (refinement->max_level() == 0) return;
  MeshTopology lean;
  lean.vertex_count = refinement->levels.back().vertex_count;
  lean.faces = std::move(refinement->levels.back().faces);
  refinement->levels.back() = std::move(lean);
}

// Returns the sum that there was.
double Normalize(std::vector<double>* shares) {
  double total = 0;
  for (double share : *shares) total += share;
  for (double& share : *shares) {
    share = total > 0 ? share / total : 1.0 / static_cast<double>(shares->size());
  }
  return total;
}

}  // namespace

absl::StatusOr<DomainSamples> BuildDomainSamples(const ControlMesh& mesh, int level,
                                                 const RunContext& context) {
  DomainSamples samples;
  RILIEVO_ASSIGN_OR_RETURN(samples.refinement, RefineTopology(mesh, level, context));
  RILIEVO_ASSIGN_OR_RETURN(samples.stencils,
                           BuildLimitStencils(samples.refinement, level, context));
  samples.rings = BuildVertexRings(samples.finest());
  samples.control_rings = BuildVertexRings(samples.refinement.levels.front());
  if (!samples.refinement.quads.empty()) ListQuadRings(&samples);
  AssignOwners(SamplesOfControlFaces(samples.refinement, level), samples.size(), &samples);
  LinkBoundary(samples.finest(), &samples);
  ListSharp(&samples);
  RILIEVO_ASSIGN_OR_RETURN(CreaseTopology creases,
                           BuildCreaseTopology(mesh, samples.refinement.levels.front()));
  samples.control_kinds = std::move(creases.kinds);
  LeaveFaces(&samples.refinement);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  return samples;
}

absl::Status SampleSurface(const DomainSamples& samples, const Eigen::Matrix3Xd& control_points,
                           const RunContext& context, SampledSurface* surface) {
  const LimitStencils& stencils = samples.stencils;
  surface->positions.resize(3, samples.size());
  surface->normals.resize(3, samples.size());
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(samples.size(), kLightBlock, context, [&](int64_t i) {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d tangent_u = Eigen::Vector3d::Zero();
    Eigen::Vector3d tangent_v = Eigen::Vector3d::Zero();
    const auto last = static_cast<size_t>(stencils.begin[static_cast<size_t>(i) + 1]);
    for (auto e = static_cast<size_t>(stencils.begin[static_cast<size_t>(i)]); e < last; ++e) {
      const auto point = control_points.col(stencils.control_vertices[e]);
      position += stencils.position[e] * point;
      tangent_u += stencils.tangent_u[e] * point;
      tangent_v += stencils.tangent_v[e] * point;
    }
    surface->positions.col(i) = position;
    surface->normals.col(i) = tangent_u.cross(tangent_v).normalized();
  }));
  surface->side_normals = SideNormals(stencils.sectors, control_points);
  SetSharpNormals(stencils, control_points, surface->normals);
  return absl::OkStatus();
}

AreaShares ShareArea(const DomainSamples& samples, const SampledSurface& surface) {
  AreaShares shares;
  shares.samples.assign(static_cast<size_t>(samples.size()), 0.0);
  shares.control_vertices.assign(static_cast<size_t>(samples.control_vertex_count()), 0.0);
  const MeshTopology& fine = samples.finest();
  const MeshTopology& coarse = samples.refinement.levels.front();
  const int descendants = fine.face_count() / coarse.face_count();
  for (int face = 0; face < fine.face_count(); ++face) {
    const auto corner = [&](int k) { return surface.positions.col(fine.faces(k, face)); };
    const Eigen::Vector3d side = corner(1) - corner(0);
    const double third = side.cross(corner(2) - corner(0)).norm() / 6;
    for (int k = 0; k < 3; ++k) {
      shares.samples[static_cast<size_t>(fine.faces(k, face))] += third;
      shares.control_vertices[static_cast<size_t>(coarse.faces(k, face / descendants))] += third;
    }
  }
  shares.area = Normalize(&shares.samples);
  Normalize(&shares.control_vertices);
  return shares;
}

}  // namespace rilievo
