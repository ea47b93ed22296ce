// A scan that goes to disk as it is read, and its surface.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/reconstruct_options.h"
#include "client/formats/scan_reader.h"
#include "client/library/reconstruction_client.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_folder.h"
#include "core/pipeline/reconstruct.h"
#include "rilievo/v1/options.pb.h"

namespace rilievo {

struct PagedFile {
  ScanFile file;                      // without its points
  std::shared_ptr<KeptScratch> kept;  // its folder; null: its files have no names
  std::shared_ptr<const PagedScan> scan;
};

// `folder` empty: files without names, where temporary files go, that end with this process. Else
// what is finished stays there, for a run of the same scan with the same options.
struct ScratchArguments {
  std::string folder;
  PartSizes sizes;  // of the parts that will be made of the scan
};

// All inputs of LoadScan, or what an earlier run has left of one in the scratch folder. Standard
// input is not found again, so its files have no names. Stations, normals and colours of the points
// are left out. After an error that IsLasting() nothing stays in the scratch folder.
absl::StatusOr<PagedFile> LoadPaged(const std::string& path, const ScanArguments& arguments,
                                    const ReconstructArguments& options,
                                    const ScratchArguments& scratch, const std::stop_token& stop);

// The points of the scan alone, in files without names in the `scratch` folder; empty: where
// temporary files go. The errors of LoadPaged().
absl::StatusOr<std::shared_ptr<const PagedScan>> PageScan(const std::string& path,
                                                          const ScanArguments& arguments,
                                                          const std::string& scratch,
                                                          const std::stop_token& stop);

// Whether the same scan with the same options ends with this error each time.
bool IsLasting(const absl::Status& status);

// ReconstructPaged() in this process. The errors are those of a call to a server.
absl::StatusOr<ReconstructResult> ReconstructPages(
    const PagedScan& scan, const PartSizes& sizes, const v1::ReconstructOptions& options,
    const std::function<void(const v1::Progress&)>& progress, const std::stop_token& stop);

}  // namespace rilievo
