// What shapes a surface, as options of a command line: of `reconstruct` and of `jobs submit`.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/point_layers.h"
#include "rilievo/v1/options.pb.h"

namespace rilievo {

struct ReconstructArguments {
  std::string control_mesh, topology = "auto", boundary = "keep", creases = "auto", fit;
  std::string stations = "auto", normals = "auto";
  std::optional<uint32_t> max_level, control_faces, threads;
  std::optional<uint64_t> seed, max_bytes;
  std::optional<double> height_step, max_error;
  bool no_measure = false;
};

// Adds them to a command; `arguments` must outlive it.
void AddReconstructOptions(CLI::App* app, ReconstructArguments* arguments);

// Appends the files that they name.
void AppendFilesOf(const ReconstructArguments& arguments, std::vector<std::string>* files);

// What is to be read of a scan for them.
WantedLayers LayersFor(const ReconstructArguments& arguments);

// As the protocol says it; reads the file of the control mesh.
absl::StatusOr<v1::ReconstructOptions> OptionsFrom(const ReconstructArguments& arguments);

}  // namespace rilievo
