// Several scans of one thing, on their way to become one.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/place_options.h"
#include "client/formats/scan_reader.h"
#include "core/base/run_context.h"
#include "core/registration/align_scans.h"

namespace rilievo {

struct ScanSet {
  std::vector<std::string> paths, formats;
  std::vector<PointCloud> clouds;
  std::vector<PointLayers> layers;
  ScanPlace place;  // of all
};

// INVALID_ARGUMENT, naming both files and the options that help, where two inputs do not have the
// same unit, way up and coordinate reference system, which `first` and `second` say.
absl::Status CheckSamePlace(const std::string& first_path, const ScanPlace& first,
                            const std::string& second_path, const ScanPlace& second);

// All files, read as LoadScan does; what their files say of unit, way up and coordinate reference
// system, unless `given` says it. Errors of LoadScan; INVALID_ARGUMENT, naming two files and the
// option that helps, where they do not say the same.
absl::StatusOr<ScanSet> LoadScans(const std::vector<std::string>& paths,
                                  const ScanArguments& arguments, const PlaceArguments& given,
                                  const WantedLayers& wanted);

// Aligns them and moves each to its place (AlignScans), unless the alignment is not sound (see
// CheckAlignment, which says why). An error names the file.
absl::StatusOr<Alignment> AlignSet(const RunContext& context, ScanSet* set);

// All points as one scan (MergeClouds). Layers that not every scan has are left out.
absl::StatusOr<ScanFile> MergeSet(ScanSet set);

// "a.ply and 3 more".
std::string NameOfAll(const std::vector<std::string>& paths);

}  // namespace rilievo
