#include "server/conversion/scan_bytes.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlockPoints = 1 << 15;

std::string Hexadecimal(Sha256 hash) {
  const auto digest = hash.Finish();
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

absl::StatusOr<PointCloud> DecodeFile(const FileDescriptor& file, const std::string& sha256,
                                      const PointLayout& layout) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file.Size());
  const int64_t point_bytes = layout.bytes(), block_bytes = kBlockPoints * point_bytes;
  if (size % point_bytes != 0) {
    return absl::DataLossError(absl::StrCat("the stored scan has ", size, " bytes; whole points ",
                                            "take ", point_bytes, " each"));
  }
  Sha256 hash;
  PointCloud scan = RoomForPoints(size / point_bytes, layout);
  int64_t next = 0;
  std::string block;
  for (int64_t at = 0; at < size; at += block_bytes) {
    block.resize(static_cast<size_t>(std::min(block_bytes, size - at)));
    RILIEVO_RETURN_IF_ERROR(file.ReadAt(at, block.data(), block.size()));
    if (!sha256.empty()) {
      hash.Add({reinterpret_cast<const uint8_t*>(block.data()), block.size()});
    }
    next = UnpackPoints(block, layout, next, &scan);
  }
  if (!sha256.empty() && Hexadecimal(hash) != sha256) {
    return absl::DataLossError(
        absl::StrCat("the stored scan is damaged: it was to have the SHA-256 ", sha256));
  }
  return scan;
}

}  // namespace

absl::StatusOr<PointCloud> ScanBytes::Decode(const PointLayout& layout) && {
  if (file_.valid()) return DecodeFile(FileDescriptor(std::move(file_)), sha256_, layout);
  int64_t size = 0;
  for (const std::string& block : blocks_) size += static_cast<int64_t>(block.size());
  PointCloud scan = RoomForPoints(size / layout.bytes(), layout);
  int64_t next = 0;
  for (std::string& block : blocks_) {
    next = UnpackPoints(block, layout, next, &scan);
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
