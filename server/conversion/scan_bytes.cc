#include "server/conversion/scan_bytes.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

static_assert(std::endian::native == std::endian::little, "coordinates travel little-endian");

constexpr int64_t kBlockBytes = 24 << 15;  // whole points of either size

// `bytes` without alignment; returns one behind the last value written.
double* AppendCoordinates(const std::string& bytes, CoordinateType type, double* target) {
  if (type == CoordinateType::kFloat64) {
    std::memcpy(target, bytes.data(), bytes.size());
    return target + bytes.size() / sizeof(double);
  }
  for (size_t i = 0; i < bytes.size() / sizeof(float); ++i) {
    float value;
    std::memcpy(&value, bytes.data() + i * sizeof(float), sizeof(float));
    *target++ = value;
  }
  return target;
}

PointCloud PointsOfBytes(int64_t bytes, CoordinateType type) {
  PointCloud scan;
  scan.points.resize(3, static_cast<Eigen::Index>(bytes / BytesOfPoint(type)));
  return scan;
}

std::string Hexadecimal(Sha256 hash) {
  const auto digest = hash.Finish();
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

absl::StatusOr<PointCloud> DecodeFile(const FileDescriptor& file, const std::string& sha256,
                                      CoordinateType type) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file.Size());
  if (size % BytesOfPoint(type) != 0) {
    return absl::DataLossError(absl::StrCat("the stored scan has ", size, " bytes; whole points ",
                                            "take ", BytesOfPoint(type), " each"));
  }
  Sha256 hash;
  PointCloud scan = PointsOfBytes(size, type);
  double* target = scan.points.data();
  std::string block;
  for (int64_t at = 0; at < size; at += kBlockBytes) {
    block.resize(static_cast<size_t>(std::min(kBlockBytes, size - at)));
    RILIEVO_RETURN_IF_ERROR(file.ReadAt(at, block.data(), block.size()));
    if (!sha256.empty()) {
      hash.Add({reinterpret_cast<const uint8_t*>(block.data()), block.size()});
    }
    target = AppendCoordinates(block, type, target);
  }
  if (!sha256.empty() && Hexadecimal(hash) != sha256) {
    return absl::DataLossError(
        absl::StrCat("the stored scan is damaged: it was to have the SHA-256 ", sha256));
  }
  return scan;
}

}  // namespace

absl::StatusOr<PointCloud> ScanBytes::Decode(CoordinateType coordinates) && {
  if (file_.valid()) return DecodeFile(FileDescriptor(std::move(file_)), sha256_, coordinates);
  int64_t size = 0;
  for (const std::string& block : blocks_) size += static_cast<int64_t>(block.size());
  PointCloud scan = PointsOfBytes(size, coordinates);
  double* target = scan.points.data();
  for (std::string& block : blocks_) {
    target = AppendCoordinates(block, coordinates, target);
    std::string().swap(block);
  }
  return scan;
}

absl::StatusOr<FileDescriptor> ScanBytes::TakeFile() && {
  if (file_.valid()) return std::move(file_);
  FileDescriptor memory(memfd_create("points", MFD_CLOEXEC));
  if (!memory.valid()) return StatusOfErrno(errno, "a file in memory");
  for (std::string& block : blocks_) {
    RILIEVO_RETURN_IF_ERROR(memory.Write(block.data(), block.size()));
    std::string().swap(block);
  }
  return memory;
}

}  // namespace rilievo
