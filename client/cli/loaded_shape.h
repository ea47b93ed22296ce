// Whatever a command is pointed at: a .dss surface, a mesh, or a scan.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/scan_reader.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/open_dss.h"
#include "core/geometry/triangle_mesh.h"

namespace CLI {
class App;
}

namespace rilievo {

struct LoadedShape {
  TriangleMesh mesh;             // scan frame; no triangles: points
  std::vector<uint8_t> sources;  // HeightSource a vertex; empty if unknown
  std::vector<float> heights;    // displacement a vertex, unit frame; empty if unknown
  std::vector<float> changes;    // of heights by the last update; empty if there was none
  std::vector<Rgb> colors;       // a vertex; empty if unknown
  std::string description;       // for people
  ScanPlace place = {};          // of a surface or a scan
  double diagonal = 0;           // of a surface's frame; 0 if unknown
};

// --format of a command: the extension of inputs without one.
void AddFormatOption(CLI::App* app, std::string* format);

// How a scan is read.
struct ScanArguments {
  std::string format;             // see AddFormatOption; may be empty
  bool points_only = false;       // a mesh may stand for its vertices
  std::vector<int> classes = {};  // see WantedLayers
  bool last_returns = false;      // likewise
  std::string trajectory = {};    // a file, see Trajectory; empty: none
};

// --points-only, --classes and --last-returns of a command; `arguments` must outlive it.
void AddScanOptions(CLI::App* app, ScanArguments* arguments);

// --trajectory of a command that uses stations; `arguments` must outlive it.
void AddTrajectoryOption(CLI::App* app, ScanArguments* arguments);

// All inputs: "-" is the standard input. INVALID_ARGUMENT for a mesh (PLY and OBJ with faces, STL,
// GLB) unless its vertices alone are wanted, and for a trajectory where stations are wanted of a
// scan without GPS times.
absl::StatusOr<ScanFile> LoadScan(const std::string& path, const ScanArguments& arguments,
                                  const WantedLayers& wanted = {});

// A mesh with its triangles, and its colours where wanted; `format` as in AddFormatOption.
// INVALID_ARGUMENT for a file without triangles.
absl::StatusOr<ScanFile> LoadMesh(const std::string& path, const std::string& format,
                                  bool with_colors);

// The whole file, or the status of what prevents it, with the path.
absl::StatusOr<std::vector<uint8_t>> ReadBytes(const std::string& path);

// Of such bytes; an error names the path, and what makes a surface of a scan or a mesh.
absl::StatusOr<DecodedSurface> DecodeBytes(const std::string& path,
                                           const std::vector<uint8_t>& bytes,
                                           const RunContext& context);

// The same of what comes before the heights, and all checksums.
absl::StatusOr<OpenedDss> OpenBytes(const std::string& path, const std::vector<uint8_t>& bytes);

absl::StatusOr<DecodedSurface> LoadDss(const std::string& path, const RunContext& context);

// What is taken of a .dss.
enum class ShownPart {
  kSurface,
  kDomain,       // the Loop surface: all heights zero
  kControlMesh,  // its polygons
};

// A surface is tessellated at `level`, or at its finest. INVALID_ARGUMENT when a level is asked of
// something that has none.
absl::StatusOr<LoadedShape> LoadShape(const std::string& path, std::optional<int> level,
                                      const RunContext& context, const std::string& format = "",
                                      ShownPart part = ShownPart::kSurface);

// Length of the bounding box's diagonal over the finite vertices.
double DiagonalOf(const Eigen::Matrix3Xd& vertices);

}  // namespace rilievo
