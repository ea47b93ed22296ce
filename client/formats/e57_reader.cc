// E57 1.0 (ASTM E2807-11), all scans of a file as one.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/crs_text.h"
#include "client/formats/e57/paged_file.h"
#include "client/formats/e57/scan_description.h"
#include "client/formats/e57/section_reader.h"
#include "client/formats/e57/xml_tree.h"
#include "client/formats/point_collector.h"
#include "client/formats/scan_reader.h"
#include "client/formats/sight_collector.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using e57::PagedFile;
using e57::ScanDescription;
using e57::SectionReader;

constexpr uint64_t kMostXml = uint64_t{64} << 20;
constexpr size_t kE57Block = 4096;  // records that are decoded at a time

struct Description {
  std::vector<ScanDescription> scans;
  std::string crs;
};

absl::StatusOr<Description> Describe(PagedFile* file) {
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t begin,
                           file->Logical(file->xml_offset(), "the XML section"));
  const uint64_t length = file->xml_length();
  if (length > file->logical_size() - begin || length > kMostXml) {
    return absl::DataLossError(
        absl::StrCat("E57: an XML section of ", length, " bytes at byte ", file->xml_offset(),
                     ", at most ", std::min(file->logical_size() - begin, kMostXml),
                     " are possible; damaged file? copy or export it again"));
  }
  std::string text(static_cast<size_t>(length), '\0');
  RILIEVO_RETURN_IF_ERROR(file->Read(begin, text.size(), text.data()));
  RILIEVO_ASSIGN_OR_RETURN(const e57::XmlElement root, e57::ParseXml(text));
  Description description;
  RILIEVO_ASSIGN_OR_RETURN(description.scans, e57::DescribeScans(root));
  const e57::XmlElement* crs = root.Child("coordinateMetadata");
  if (crs != nullptr) description.crs = CrsText(crs->text);
  return description;
}

uint8_t Channel(double value, const std::array<double, 2>& limits) {
  const double share = (value - limits[0]) / (limits[1] - limits[0]);
  return static_cast<uint8_t>(share >= 1 ? 255 : share > 0 ? std::lround(255 * share) : 0);
}

class E57Reader {
 public:
  E57Reader(PagedFile* file, Description description, const WantedLayers& wanted)
      : file_(file),
        scans_(std::move(description.scans)),
        crs_(std::move(description.crs)),
        wanted_(wanted),
        sights_(wanted) {
    sights_.set_color_kind(ColorCollector::Kind::kBytes);
  }

  absl::StatusOr<ScanFile> Read() {
    if (scans_.empty()) {
      return absl::InvalidArgumentError(
          "E57: the file holds no scan (data3D is empty); export it with its points");
    }
    RILIEVO_ASSIGN_OR_RETURN(std::vector<SectionReader> sections, OpenSections());
    for (size_t i = 0, section = 0; i < scans_.size(); ++i) {
      if (scans_[i].record_count == 0) continue;
      RILIEVO_RETURN_IF_ERROR(ReadRecords(scans_[i], std::move(sections[section++])));
    }
    if (points_.offered() == 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("E57: all ", invalid_, " points are marked as invalid"));
    }
    return Finish();
  }

 private:
  // The fields that are read of a scan, in the order of their values: place, state, class,
  // intensity, colour and its state, normal; all but the first only where the scan has them and
  // they are wanted.
  std::vector<int> WantedFields(const ScanDescription& scan) const {
    std::vector<int> fields(scan.place.begin(), scan.place.end());
    if (scan.invalid_state >= 0) fields.push_back(scan.invalid_state);
    if (HasClasses(scan)) fields.push_back(scan.classification);
    if (HasIntensity(scan)) fields.push_back(scan.intensity);
    if (HasColors(scan)) {
      fields.insert(fields.end(), scan.color.begin(), scan.color.end());
      if (scan.color_invalid >= 0) fields.push_back(scan.color_invalid);
    }
    if (HasNormals(scan)) fields.insert(fields.end(), scan.normal.begin(), scan.normal.end());
    return fields;
  }
  bool HasIntensity(const ScanDescription& scan) const {
    return wanted_.intensity && scan.intensity >= 0;
  }
  bool HasColors(const ScanDescription& scan) const { return wanted_.colors && scan.color[0] >= 0; }
  bool HasClasses(const ScanDescription& scan) const {
    return !wanted_.classes.empty() && scan.classification >= 0;
  }

  bool HasNormals(const ScanDescription& scan) const {
    return wanted_.normals && scan.normal[0] >= 0;
  }

  // Those of the scans with records. Each section bounds the points of its scan; sections that
  // together are no larger than the file bound those of all scans.
  absl::StatusOr<std::vector<SectionReader>> OpenSections() {
    std::vector<SectionReader> sections;
    uint64_t records = 0, bytes = 0;
    for (const ScanDescription& scan : scans_) {
      if (scan.record_count == 0) continue;
      RILIEVO_ASSIGN_OR_RETURN(SectionReader section,
                               SectionReader::Open(file_, scan, WantedFields(scan)));
      records += scan.record_count;
      bytes += section.size();
      if (bytes > file_->logical_size()) {
        return absl::DataLossError(absl::StrCat("E57 ", scan.name,
                                                ": its section overlaps that of another scan; "
                                                "damaged file? export it again"));
      }
      sections.push_back(std::move(section));
    }
    if (records == 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("E57: 0 points in ", ScanCount(), ", the file holds none"));
    }
    RILIEVO_RETURN_IF_ERROR(points_.Reserve(records));
    any_normals_ = std::any_of(scans_.begin(), scans_.end(),
                               [&](const ScanDescription& scan) { return HasNormals(scan); });
    return sections;
  }

  // Takes the section, so that its buffers go before those of the next one come.
  absl::Status ReadRecords(const ScanDescription& scan, SectionReader section) {
    std::vector<std::vector<double>> values;
    for (;;) {
      RILIEVO_ASSIGN_OR_RETURN(const size_t count, section.Next(kE57Block, &values));
      if (count == 0) return absl::OkStatus();
      for (size_t i = 0; i < count; ++i) AddRecord(scan, values, i);
      RILIEVO_RETURN_IF_ERROR(points_.status());
    }
  }

  void AddRecord(const ScanDescription& scan, const std::vector<std::vector<double>>& values,
                 size_t i) {
    size_t next = 3;
    // State 1 says that only the direction is valid, state 2 that nothing is.
    if (scan.invalid_state >= 0 && values[next++][i] != 0) {
      ++invalid_;
      return;
    }
    if (HasClasses(scan) && !points_.Chooses(values[next++][i])) return;
    Eigen::Vector3d point(values[0][i], values[1][i], values[2][i]);
    if (scan.spherical) point = FromSpherical(point);
    if (scan.has_pose) point = scan.rotation * point + scan.translation;
    points_.Add(point.x(), point.y(), point.z());
    sights_.AddStation(StationOf(scan));
    if (HasIntensity(scan)) sights_.AddIntensity(values[next++][i]);
    if (HasColors(scan)) {
      std::array<double, 3> color{};
      for (size_t k = 0; k < 3; ++k) color[k] = Channel(values[next++][i], scan.color_limits[k]);
      if (scan.color_invalid >= 0 && values[next++][i] != 0) color.fill(std::nan(""));
      sights_.AddColor(color.data());
    }
    if (!any_normals_) return;
    Eigen::Vector3d normal = UnknownPlace();
    if (HasNormals(scan)) {
      normal = scan.rotation *
               Eigen::Vector3d(values[next][i], values[next + 1][i], values[next + 2][i]);
    }
    sights_.AddNormal(normal);
  }

  // A scan in spherical coordinates has its sensor at their origin; so has one in cartesian
  // coordinates whose pose moves it. Without a pose, or with one that does nothing, its points may
  // have been moved before.
  static Eigen::Vector3d StationOf(const ScanDescription& scan) {
    const bool is_moved =
        scan.has_pose && !(scan.rotation.isIdentity(0) && scan.translation.isZero(0));
    return scan.spherical || is_moved ? scan.translation : UnknownPlace();
  }

  // `place`: range, azimuth from the x axis towards y, elevation from the x-y plane towards z.
  static Eigen::Vector3d FromSpherical(const Eigen::Vector3d& place) {
    const double range = place[0], azimuth = place[1], elevation = place[2];
    const double across = range * std::cos(elevation);
    return {across * std::cos(azimuth), across * std::sin(azimuth), range * std::sin(elevation)};
  }

  std::string ScanCount() const {
    return absl::StrCat(scans_.size(), scans_.size() == 1 ? " scan" : " scans");
  }

  ScanFile Finish() {
    ScanFile scan;
    scan.format = absl::StrCat("E57 1.0, ", ScanCount());
    if (invalid_ > 0) absl::StrAppend(&scan.format, ", without ", invalid_, " invalid points");
    absl::StrAppend(&scan.format, sights_.LeftOut(points_.count()));
    scan.cloud.sights = sights_.Finish(points_.count());
    scan.layers.intensity = sights_.FinishIntensity(points_.count());
    scan.cloud.points = points_.Finish();
    scan.class_counts = points_.class_counts();
    scan.place.metres_per_unit = 1;
    scan.place.crs = crs_;
    return scan;
  }

  PagedFile* const file_;
  const std::vector<ScanDescription> scans_;
  const std::string crs_;
  const WantedLayers wanted_;
  PointCollector points_{wanted_};
  SightCollector sights_;
  uint64_t invalid_ = 0;
  bool any_normals_ = false;  // of some scan, and wanted
};

}  // namespace

absl::StatusOr<ScanFile> ReadE57Scan(std::istream& in, const WantedLayers& wanted) {
  RILIEVO_ASSIGN_OR_RETURN(const std::unique_ptr<PagedFile> file, PagedFile::Open(in));
  RILIEVO_ASSIGN_OR_RETURN(Description description, Describe(file.get()));
  return E57Reader(file.get(), std::move(description), wanted).Read();
}

}  // namespace rilievo
