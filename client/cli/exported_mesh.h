// The mesh that `rilievo export` makes of a surface, and what was asked of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/export_place.h"
#include "client/cli/loaded_shape.h"
#include "client/formats/point_layers.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/geometry/spatial_frame.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/adaptive_tessellation.h"
#include "core/surface/height_source.h"

namespace rilievo {

struct ExportArguments {
  std::string input, output, format = "ply";
  std::optional<int> level;
  std::string tolerance;  // see length_words.h
  AdaptiveOptions adaptive;
  ExportPlaceArguments place;
  bool cage = false, json = false;
  std::vector<double> camera;  // x, y, z, or empty
  std::string carry;           // a scan
  std::optional<int> texture;  // pixels
  ScanArguments scan;
  std::vector<std::string> region;
  bool compress = false;

  bool adapts() const { return !tolerance.empty() || adaptive.triangles || adaptive.camera; }
};

struct ExportedMesh {
  TriangleMesh mesh;
  std::vector<HeightSource> sources;
  PointLayers layers;
  Eigen::Matrix2Xf texture;  // with --texture
  std::string png;
  std::string how;  // for people
  SpatialFrame frame;
  ScanPlace place;
};

// --tolerance as a fraction: of the diagonal, or with a camera of the distance from there.
absl::StatusOr<double> ToleranceOf(const ExportArguments& arguments, const SpatialFrame& frame,
                                   const ScanPlace& place);

// The whole surface, or its control mesh, as asked for.
absl::StatusOr<ExportedMesh> MeshOf(const DecodedSurface& decoded, const ExportArguments& arguments,
                                    const RunContext& context);

// Only what the region depends on is decoded: the control mesh, to see which faces those are, and
// then they.
absl::StatusOr<ExportedMesh> RegionOf(const std::vector<uint8_t>& bytes,
                                      const ExportArguments& arguments, const RunContext& context);

// Colours and intensity of the scan of --carry at the vertices; an error names it.
absl::StatusOr<PointLayers> Carried(const ExportArguments& arguments,
                                    const Eigen::Matrix3Xd& vertices, const RunContext& context);

}  // namespace rilievo
