#include "client/formats/scan_reader.h"

#include <cstdint>
#include <iostream>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/chosen_classes.h"
#include "client/formats/file_kind.h"
#include "client/formats/open_input.h"
#include "core/base/status_macros.h"

namespace rilievo {

namespace {

absl::StatusOr<ScanFile> ReadAnyScan(std::istream& in, const std::string& name,
                                     const WantedLayers& wanted) {
  HeadedInput input(in);
  RILIEVO_ASSIGN_OR_RETURN(const FileKind kind, RecognizeFile(input.head(), input.size(), name));
  switch (kind) {
    case FileKind::kPly:
      return ReadPlyScan(input.stream(), wanted);
    case FileKind::kPcd:
      return ReadPcdScan(input.stream(), wanted);
    case FileKind::kXyz:
      return ReadXyzScan(input.stream(), wanted);
    case FileKind::kObj:
      return ReadObjScan(input.stream(), wanted);
    case FileKind::kLas:
      return ReadLasScan(input.stream(), wanted);
    case FileKind::kE57:
      return ReadE57Scan(input.stream(), wanted);
    case FileKind::kPtx:
      return ReadPtxScan(input.stream(), wanted);
    case FileKind::kStl:
      return absl::InvalidArgumentError(
          "an STL file holds a mesh, not a scan; give the scan as PLY, PCD, XYZ, PTS, OBJ, LAS, "
          "LAZ, E57 or PTX");
    case FileKind::kGlb:
      return absl::InvalidArgumentError(
          "a GLB file holds a mesh, not a scan; give the scan as PLY, PCD, XYZ, PTS, OBJ, LAS, "
          "LAZ, E57 or PTX");
    case FileKind::kDss:
      return absl::InvalidArgumentError(
          "a .dss file holds a surface, not a scan; 'rilievo export' makes a mesh of it, 'rilievo "
          "info' and 'rilievo view' show it");
  }
  return absl::InternalError("unknown kind of file");
}

}  // namespace

absl::StatusOr<ScanFile> ReadScanStream(std::istream& in, const std::string& name,
                                        const WantedLayers& wanted) {
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, ReadAnyScan(in, name, wanted));
  if (!wanted.classes.empty()) RILIEVO_RETURN_IF_ERROR(TellChosen(wanted.classes, &scan));
  return scan;
}

}  // namespace rilievo
