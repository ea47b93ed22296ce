// A scan that goes to disk as it is read, and its surface.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/loaded_shape.h"
#include "client/formats/scan_reader.h"
#include "client/library/reconstruction_client.h"
#include "core/paging/paged_scan.h"
#include "rilievo/v1/options.pb.h"

namespace rilievo {

struct PagedFile {
  ScanFile file;  // without its points
  std::shared_ptr<const PagedScan> scan;
};

// All inputs of LoadScan; the points lie in files of `scratch_folder` that end with this process.
// Stations, normals and colours of the points are left out.
absl::StatusOr<PagedFile> LoadPaged(const std::string& path, const ScanArguments& arguments,
                                    const std::string& scratch_folder, const std::stop_token& stop);

// ReconstructPaged() in this process. The errors are those of a call to a server.
absl::StatusOr<ReconstructResult> ReconstructPages(
    const PagedScan& scan, const v1::ReconstructOptions& options,
    const std::function<void(const v1::Progress&)>& progress, const std::stop_token& stop);

}  // namespace rilievo
