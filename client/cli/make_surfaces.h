// From files of scans or meshes to files of surfaces: what `reconstruct` and `convert` share.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/reconstruct_options.h"
#include "client/cli/report_output.h"
#include "client/cli/server_connection.h"
#include "client/cli/surface_output.h"
#include "client/formats/scan_reader.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_folder.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

struct MakingArguments {
  std::vector<std::string> inputs;
  std::vector<std::string> further_inputs;  // read besides them; empty names are none
  std::string report;
  SurfaceOutputArguments surface;
  ServerArguments connection;
  ReconstructArguments options;
  bool quiet = false, json = false;
};

// All but the inputs; `arguments` must outlive the command.
void AddMakingOptions(CLI::App* app, ShapeInput input, MakingArguments* arguments);

// A scan or a mesh as it was read, and the words for where it comes from.
struct Source {
  ScanFile scan;
  ReportPaths paths;                                 // no target yet
  std::shared_ptr<const PagedScan> pages = nullptr;  // the points of a scan that went to disk
  PartSizes sizes = {};                              // of the parts that are made of them
  std::shared_ptr<KeptScratch> kept = nullptr;       // see PagedFile
  std::string warning = {};                          // for the report; empty: none
};

using ReadSource = std::function<absl::StatusOr<Source>(const std::string& path)>;

// The surface of each of `names`, most often the inputs; they name the outputs. Goes on after one
// that fails, and ends with the exit code of the first that did. `further_outputs`: that are
// written besides; all are checked before anything is read.
absl::Status MakeSurfaces(const MakingArguments& arguments, const std::vector<std::string>& names,
                          const ReadSource& read, const std::vector<std::string>& further_outputs,
                          const std::stop_token& stop);

}  // namespace rilievo
