// What became of an alignment, for people and for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/geometry/scan_place.h"
#include "core/registration/align_scans.h"

namespace rilievo {

// An alignment of files.
struct AlignmentReport {
  std::vector<std::string> scans;  // paths, by the number of the scan
  Alignment alignment;
  ScanPlace place;  // for the unit of lengths
};

// A line for each pair of scans with points in common, of at most 80 columns.
std::string AlignmentText(const AlignmentReport& report);

// The same as one clause: how many pairs overlap, and how far the worst of them is apart.
std::string AlignedLine(const AlignmentReport& report);

// aligned, rounds, converged, diagonal, unit; scans: scan, move (4 rows of 4: aligned = move *
// point), turn_degrees; pairs: first, second, overlap, rms, spread, explained, rms_ratio, matches,
// overlaps, fits.
nlohmann::ordered_json AlignmentJson(const AlignmentReport& report);

// FAILED_PRECONDITION, naming the scans and the figures, where the scans do not all hang together
// by overlaps, or overlap and do not fit.
absl::Status CheckAlignment(const AlignmentReport& report);

}  // namespace rilievo
