// A surface whose heights lie elsewhere than in memory, and parts of it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/spatial_frame.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/crease_topology.h"
#include "core/loop/face_vertices.h"
#include "core/loop/sub_mesh.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/height_source.h"

namespace rilievo {

// The heights of one level of a surface, control face by control face.
class FaceHeights {
 public:
  virtual ~FaceHeights() = default;
  // By vertex of `here`: vertices, at the level of the heights, of a mesh whose face i is control
  // face faces[i], with the same first corner. For several threads at once.
  virtual absl::Status Read(const std::vector<int>& faces, const FaceVertices& here,
                            std::vector<float>* heights,
                            std::vector<HeightSource>* sources) const = 0;
};

// As DisplacedSurface.
struct StoredSurface {
  SpatialFrame frame;
  ControlMesh control_mesh;
  int max_level = 0;
  const FaceHeights* heights = nullptr;
  std::array<int64_t, 3> source_counts{};  // vertices of each HeightSource
};

// Vertices of level `level` of a mesh.
int64_t VertexCountAt(const MeshTopology& control, int level);

// Some control faces and those around them, as a surface of its own.
struct SurfacePart {
  DisplacedSurface surface;
  std::vector<int> faces;  // of the whole, ascending: control face i of `surface` is faces[i]
  std::vector<int> inner;  // which of them were asked for, ascending
};

// Cuts parts out of a control mesh.
class PartCutter {
 public:
  // Errors of BuildMeshTopology, BuildCreaseTopology and FlagsOfDiagonals. `mesh` is kept by
  // reference.
  static absl::StatusOr<PartCutter> Make(const ControlMesh& mesh);
  // `topology`: of it.
  static absl::StatusOr<PartCutter> Make(const ControlMesh& mesh, MeshTopology topology);

  const MeshTopology& topology() const { return topology_; }
  // By edge: 1 for the diagonals of quads; empty for a Loop surface.
  const std::vector<uint8_t>& diagonal() const { return diagonal_; }
  // `faces`: ascending. With all faces within `rings` of them and those that touch these.
  SubMesh Cut(std::span<const int> faces, int rings) const;

 private:
  PartCutter(const ControlMesh& mesh, MeshTopology topology)
      : mesh_(mesh), topology_(std::move(topology)) {}
  const ControlMesh& mesh_;
  MeshTopology topology_;
  std::vector<SharpEdge> sharp_;
  std::vector<uint8_t> diagonal_;
};

// Where each of the wanted faces is in `faces`; both ascend.
std::vector<int> PlacesOf(std::span<const int> wanted, const std::vector<int>& faces);

// The part of `surface`, whose control mesh `cutter` cuts.
absl::StatusOr<SurfacePart> ReadPart(const StoredSurface& surface, const PartCutter& cutter,
                                     std::span<const int> faces, int rings);

}  // namespace rilievo
