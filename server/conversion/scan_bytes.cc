#include "server/conversion/scan_bytes.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "server/os/unnamed_file.h"

namespace rilievo {
namespace {

constexpr int64_t kBlockRecords = 1 << 15, kBlockBytes = 1 << 20;

std::string Hexadecimal(Sha256 hash) {
  const auto digest = hash.Finish();
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

std::span<const uint8_t> BytesOf(const std::string& block) {
  return {reinterpret_cast<const uint8_t*>(block.data()), block.size()};
}

// `sha256`: empty where it is not known.
absl::Status CheckHash(const Sha256& hash, const std::string& sha256) {
  if (sha256.empty() || Hexadecimal(hash) == sha256) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("the stored scan is damaged: it was to have the SHA-256 ", sha256));
}

// Puts together what comes in blocks of whole records, points first, and of the file behind them.
class RecordReader {
 public:
  explicit RecordReader(const PayloadSize& size)
      : layout_(size.layout), base_bytes_(size.base_bytes) {
    contents_.scan = RoomForPoints(size.points, size.layout);
    contents_.scan.triangles.resize(3, size.triangles);
    contents_.base.reserve(static_cast<size_t>(size.base_bytes));
  }

  // How many bytes of a file to read at once; 0 when nothing is left.
  int64_t NextBytes() const {
    const PointCloud& scan = contents_.scan;
    const int64_t points = scan.points.cols() - point_,
                  triangles = scan.triangles.cols() - triangle_;
    if (points > 0) return std::min(points, kBlockRecords) * layout_.bytes();
    if (triangles > 0) return std::min(triangles, kBlockRecords) * kTriangleBytes;
    return std::min(base_bytes_ - static_cast<int64_t>(contents_.base.size()), kBlockBytes);
  }

  void Read(std::string_view block) {
    PointCloud& scan = contents_.scan;
    const auto next = [&block](int64_t most) {
      const std::string_view part = block.substr(0, static_cast<size_t>(most));
      block.remove_prefix(part.size());
      return part;
    };
    point_ =
        UnpackPoints(next((scan.points.cols() - point_) * layout_.bytes()), layout_, point_, &scan);
    triangle_ = UnpackTriangles(next((scan.triangles.cols() - triangle_) * kTriangleBytes),
                                triangle_, &scan);
    contents_.base.insert(contents_.base.end(), block.begin(), block.end());
  }

  ScanContents Take() && { return std::move(contents_); }

 private:
  PointLayout layout_;
  int64_t base_bytes_;
  ScanContents contents_;
  int64_t point_ = 0, triangle_ = 0;  // the next ones
};

absl::StatusOr<ScanContents> DecodeFile(const FileDescriptor& file, const std::string& sha256,
                                        RecordReader reader) {
  Sha256 hash;
  std::string block;
  for (int64_t at = 0; reader.NextBytes() > 0; at += static_cast<int64_t>(block.size())) {
    block.resize(static_cast<size_t>(reader.NextBytes()));
    RILIEVO_RETURN_IF_ERROR(file.ReadAt(at, block.data(), block.size()));
    if (!sha256.empty()) hash.Add(BytesOf(block));
    reader.Read(block);
  }
  RILIEVO_RETURN_IF_ERROR(CheckHash(hash, sha256));
  return std::move(reader).Take();
}

}  // namespace

absl::Status ScanBytes::CheckSize(const PayloadSize& size) const {
  int64_t bytes = 0;
  for (const std::string& block : blocks_) bytes += static_cast<int64_t>(block.size());
  if (file_.valid()) {
    RILIEVO_ASSIGN_OR_RETURN(bytes, file_.Size());
  }
  if (bytes != size.bytes()) {
    return absl::DataLossError(
        absl::StrCat("the scan has ", bytes, " bytes; ", size.points, " points, ", size.triangles,
                     " triangles and a surface of ", size.base_bytes, " take ", size.bytes()));
  }
  return absl::OkStatus();
}

absl::Status ScanBytes::DecodeInBlocks(
    const PayloadSize& size,
    const std::function<absl::Status(const Eigen::Matrix3Xd& points)>& take) && {
  RILIEVO_RETURN_IF_ERROR(CheckSize(size));
  const auto unpack = [&](std::string_view block) {
    const int64_t count = static_cast<int64_t>(block.size()) / size.layout.bytes();
    PointCloud cloud = RoomForPoints(count, size.layout);
    UnpackPoints(block, size.layout, 0, &cloud);
    return take(cloud.points);
  };
  for (std::string& block : blocks_) {
    RILIEVO_RETURN_IF_ERROR(unpack(block));
    std::string().swap(block);
  }
  if (!file_.valid()) return absl::OkStatus();
  Sha256 hash;
  std::string block;
  for (int64_t point = 0; point < size.points; point += kBlockRecords) {
    const int64_t count = std::min(kBlockRecords, size.points - point);
    block.resize(static_cast<size_t>(count * size.layout.bytes()));
    RILIEVO_RETURN_IF_ERROR(file_.ReadAt(point * size.layout.bytes(), block.data(), block.size()));
    if (!sha256_.empty()) hash.Add(BytesOf(block));
    RILIEVO_RETURN_IF_ERROR(unpack(block));
  }
  return CheckHash(hash, sha256_);
}

absl::StatusOr<ScanContents> ScanBytes::Decode(const PayloadSize& size) && {
  RILIEVO_RETURN_IF_ERROR(CheckSize(size));
  RecordReader reader(size);
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
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor memory, UnnamedFile(""));
  for (std::string& block : blocks_) {
    RILIEVO_RETURN_IF_ERROR(memory.Write(block.data(), block.size()));
    std::string().swap(block);
  }
  return memory;
}

}  // namespace rilievo
