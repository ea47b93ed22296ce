#include "client/formats/scan_writer.h"

#include <cstdint>
#include <initializer_list>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/atomic_file.h"
#include "client/formats/block_writer.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

std::string Header(const PointCloud& scan, const PointLayers& layers) {
  std::string header = absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ",
                                    scan.points.cols(), "\n");
  const auto add = [&](const char* type, std::initializer_list<const char*> names) {
    for (const char* name : names) absl::StrAppend(&header, "property ", type, " ", name, "\n");
  };
  add("double", {"x", "y", "z"});
  if (scan.sights.normals.cols() > 0) add("float", {"nx", "ny", "nz"});
  if (!scan.sights.station_of.empty()) add("int", {"station"});
  if (!scan.sights.colors.empty()) add("uchar", {"red", "green", "blue"});
  if (!layers.intensity.empty()) add("float", {"intensity"});
  if (!scan.sights.station_of.empty()) {
    absl::StrAppend(&header, "element station ", scan.sights.stations.cols(), "\n");
    add("double", {"x", "y", "z"});
  }
  return absl::StrCat(header, "end_header\n");
}

void WriteVertex(const PointCloud& scan, const PointLayers& layers, size_t i, BlockWriter* writer) {
  const auto column = static_cast<Eigen::Index>(i);
  const PointSights& sights = scan.sights;
  for (const double value : scan.points.col(column)) writer->Little(value);
  if (sights.normals.cols() > 0) {
    for (const float value : sights.normals.col(column)) writer->Little(value);
  }
  if (!sights.station_of.empty()) {
    const uint16_t station = sights.station_of[i];
    writer->Little(station == kNoStation ? int32_t{-1} : int32_t{station});
  }
  if (!sights.colors.empty()) {
    for (const uint8_t channel : sights.colors[i]) writer->Little(channel);
  }
  if (!layers.intensity.empty()) writer->Little(layers.intensity[i]);
}

}  // namespace

absl::Status WritePlyScan(const PointCloud& scan, const PointLayers& layers, std::ostream& out) {
  RILIEVO_RETURN_IF_ERROR(CheckSights(scan.sights, scan.points.cols()));
  RILIEVO_RETURN_IF_ERROR(CheckLayers(layers, scan.points.cols()));
  BlockWriter writer(out);
  writer.text() += Header(scan, layers);
  for (Eigen::Index i = 0; i < scan.points.cols(); ++i) {
    WriteVertex(scan, layers, static_cast<size_t>(i), &writer);
  }
  if (scan.sights.station_of.empty()) return absl::OkStatus();
  for (const double value : scan.sights.stations.reshaped()) writer.Little(value);
  return absl::OkStatus();
}

absl::Status WritePlyScan(const std::string& path, const PointCloud& scan,
                          const PointLayers& layers) {
  return WriteFileAtomically(path,
                             [&](std::ostream& out) { return WritePlyScan(scan, layers, out); });
}

}  // namespace rilievo
