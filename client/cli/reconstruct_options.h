// What shapes a surface, as options of a command line: of `reconstruct`, `convert` and `jobs
// submit`.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/place_options.h"
#include "client/formats/point_layers.h"
#include "client/formats/scan_reader.h"
#include "rilievo/v1/options.pb.h"

namespace rilievo {

enum class ShapeInput { kScan, kMesh };

struct ReconstructArguments {
  ShapeInput input = ShapeInput::kScan;
  std::string control_mesh, topology = "auto", boundary = "keep", creases = "auto", scheme = "loop",
                            fit;
  std::string outliers = "remove", stations = "auto", normals = "auto", colors = "auto";
  std::optional<uint32_t> max_level, control_faces, threads;
  std::optional<uint64_t> seed, max_bytes;
  std::string height_step, max_error, close_holes_below,
      bridge_gaps_below;  // lengths, see length_words.h; empty: not given
  PlaceArguments place;
  bool no_measure = false;
};

// Adds to a command those that mean something of such an input; `arguments` must outlive it.
void AddReconstructOptions(CLI::App* app, ShapeInput input, ReconstructArguments* arguments);

// Appends the files that they name.
void AppendFilesOf(const ReconstructArguments& arguments, std::vector<std::string>* files);

// What is to be read of a scan for them.
WantedLayers LayersFor(const ReconstructArguments& arguments);

// Once it was read: gives it the colours that they ask for, where these are not its own. `name`: of
// the scan, for errors.
absl::Status ColorAsAsked(const ReconstructArguments& arguments, const std::string& name,
                          ScanFile* scan);

// As the protocol says it, of all scans alike; reads the file of the control mesh.
absl::StatusOr<v1::ReconstructOptions> OptionsFrom(const ReconstructArguments& arguments);

// And what depends on the scan of `path`: what its file knows of its place goes into the options,
// unless the arguments say otherwise, and lengths into its unit. kUsage for a length in a unit
// where that of the scan is not known.
absl::Status SetPlace(const ReconstructArguments& arguments, const std::string& path,
                      const ScanPlace& known, v1::ReconstructOptions* options);

}  // namespace rilievo
