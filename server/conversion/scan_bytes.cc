#include "server/conversion/scan_bytes.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlockRecords = 1 << 15;

std::string Hexadecimal(Sha256 hash) {
  const auto digest = hash.Finish();
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

// Puts together what comes in blocks of whole records, points first.
class RecordReader {
 public:
  RecordReader(const PointLayout& layout, int64_t point_count, int64_t triangle_count)
      : layout_(layout), scan_(RoomForPoints(point_count, layout)) {
    scan_.triangles.resize(3, triangle_count);
  }

  // How many bytes of a file to read at once; 0 when nothing is left.
  int64_t NextBytes() const {
    const int64_t points = scan_.points.cols() - point_;
    if (points > 0) return std::min(points, kBlockRecords) * layout_.bytes();
    return std::min(scan_.triangles.cols() - triangle_, kBlockRecords) * kTriangleBytes;
  }

  void Read(std::string_view block) {
    const int64_t bytes_of_points = (scan_.points.cols() - point_) * layout_.bytes();
    const size_t cut = std::min(block.size(), static_cast<size_t>(bytes_of_points));
    point_ = UnpackPoints(block.substr(0, cut), layout_, point_, &scan_);
    triangle_ = UnpackTriangles(block.substr(cut), triangle_, &scan_);
  }

  PointCloud Take() && { return std::move(scan_); }

 private:
  PointLayout layout_;
  PointCloud scan_;
  int64_t point_ = 0, triangle_ = 0;  // the next ones
};

absl::StatusOr<PointCloud> DecodeFile(const FileDescriptor& file, const std::string& sha256,
                                      RecordReader reader) {
  Sha256 hash;
  std::string block;
  for (int64_t at = 0; reader.NextBytes() > 0; at += static_cast<int64_t>(block.size())) {
    block.resize(static_cast<size_t>(reader.NextBytes()));
    RILIEVO_RETURN_IF_ERROR(file.ReadAt(at, block.data(), block.size()));
    if (!sha256.empty()) {
      hash.Add({reinterpret_cast<const uint8_t*>(block.data()), block.size()});
    }
    reader.Read(block);
  }
  if (!sha256.empty() && Hexadecimal(hash) != sha256) {
    return absl::DataLossError(
        absl::StrCat("the stored scan is damaged: it was to have the SHA-256 ", sha256));
  }
  return std::move(reader).Take();
}

}  // namespace

absl::StatusOr<PointCloud> ScanBytes::Decode(const PointLayout& layout, int64_t point_count,
                                             int64_t triangle_count) && {
  int64_t size = 0;
  for (const std::string& block : blocks_) size += static_cast<int64_t>(block.size());
  if (file_.valid()) {
    RILIEVO_ASSIGN_OR_RETURN(size, file_.Size());
  }
  const int64_t announced = BytesOfRecords(layout, point_count, triangle_count);
  if (size != announced) {
    return absl::DataLossError(absl::StrCat("the scan has ", size, " bytes; ", point_count,
                                            " points and ", triangle_count, " triangles take ",
                                            announced));
  }
  RecordReader reader(layout, point_count, triangle_count);
  if (file_.valid()) {
    return DecodeFile(FileDescriptor(std::move(file_)), sha256_, std::move(reader));
  }
  for (std::string& block : blocks_) {
    reader.Read(block);
    std::string().swap(block);
  }
  return std::move(reader).Take();
}

absl::StatusOr<FileDescriptor> ScanBytes::TakeFile() && {
  if (file_.valid()) return std::move(file_);
  FileDescriptor memory(memfd_create("scan", MFD_CLOEXEC));
  if (!memory.valid()) return StatusOfErrno(errno, "a file in memory");
  for (std::string& block : blocks_) {
    RILIEVO_RETURN_IF_ERROR(memory.Write(block.data(), block.size()));
    std::string().swap(block);
  }
  return memory;
}

}  // namespace rilievo
