#include "core/paging/scratch_blocks.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {

absl::StatusOr<ScratchBlocks> ScratchBlocks::Create(const ScratchFolder& folder,
                                                    const std::string& name, int count,
                                                    int64_t block_bytes) {
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile file, ScratchFile::Create(folder, name));
  const int64_t before = file.size(), on_disk = file.BytesOnDisk();
  ScratchBlocks blocks(std::move(file), count, block_bytes);
  const int64_t all = blocks.PlaceOf(count);
  RILIEVO_RETURN_IF_ERROR(CheckRoom(folder, all - on_disk));
  RILIEVO_RETURN_IF_ERROR(blocks.file_.Resize(all));
  if (before != all) return blocks;
  for (int b = 0; b < count; ++b) {
    Block& block = blocks.blocks_[b];
    RILIEVO_RETURN_IF_ERROR(blocks.file_.ReadAt(blocks.PlaceOf(b), &block, sizeof(block)));
    if (block.bytes > block_bytes) block = Block();
  }
  return blocks;
}

absl::Status ScratchBlocks::Write(int block, std::span<const uint8_t> bytes) {
  const Block written = {static_cast<uint32_t>(bytes.size()), Crc32c(bytes)};
  const int64_t place = PlaceOf(block);
  RILIEVO_RETURN_IF_ERROR(file_.WriteAt(place, &written, sizeof(written)));
  RILIEVO_RETURN_IF_ERROR(
      file_.WriteAt(place + static_cast<int64_t>(sizeof(written)), bytes.data(), bytes.size()));
  blocks_[block] = written;
  return absl::OkStatus();
}

absl::StatusOr<std::vector<uint8_t>> ScratchBlocks::Read(int block) const {
  std::vector<uint8_t> bytes(blocks_[block].bytes);
  if (bytes.empty()) return bytes;
  RILIEVO_RETURN_IF_ERROR(file_.ReadAt(PlaceOf(block) + static_cast<int64_t>(sizeof(Block)),
                                       bytes.data(), bytes.size()));
  if (Crc32c(bytes) != blocks_[block].checksum) {
    return absl::DataLossError(absl::StrCat("block ", block, " of ", count(),
                                            " of what is known of the points is damaged on the "
                                            "scratch disk; run the command again"));
  }
  return bytes;
}

}  // namespace rilievo
