#include "core/paging/scratch_blocks.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {

absl::StatusOr<ScratchBlocks> ScratchBlocks::Create(const ScratchFolder& folder,
                                                    const std::string& name, int count,
                                                    int64_t block_bytes) {
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile file, ScratchFile::Create(folder, name));
  RILIEVO_RETURN_IF_ERROR(CheckRoom(folder, count * block_bytes - file.BytesOnDisk()));
  RILIEVO_RETURN_IF_ERROR(file.Resize(count * block_bytes));
  return ScratchBlocks(std::move(file), count, block_bytes);
}

absl::Status ScratchBlocks::Write(int block, std::span<const uint8_t> bytes) {
  RILIEVO_RETURN_IF_ERROR(file_.WriteAt(block * block_bytes_, bytes.data(), bytes.size()));
  blocks_[block] = {static_cast<uint32_t>(bytes.size()), Crc32c(bytes)};
  return absl::OkStatus();
}

absl::StatusOr<std::vector<uint8_t>> ScratchBlocks::Adopt(int block, size_t count) {
  std::vector<uint8_t> bytes(count);
  RILIEVO_RETURN_IF_ERROR(file_.ReadAt(block * block_bytes_, bytes.data(), bytes.size()));
  blocks_[block] = {static_cast<uint32_t>(bytes.size()), Crc32c(bytes)};
  return bytes;
}

absl::StatusOr<std::vector<uint8_t>> ScratchBlocks::Read(int block) const {
  std::vector<uint8_t> bytes(blocks_[block].bytes);
  if (bytes.empty()) return bytes;
  RILIEVO_RETURN_IF_ERROR(file_.ReadAt(block * block_bytes_, bytes.data(), bytes.size()));
  if (Crc32c(bytes) != blocks_[block].checksum) {
    return absl::DataLossError(absl::StrCat("block ", block, " of ", count(),
                                            " of what is known of the points is damaged on the "
                                            "scratch disk; run the command again"));
  }
  return bytes;
}

}  // namespace rilievo
