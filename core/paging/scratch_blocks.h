// Blocks of bytes on disk that may be written anew, each behind its length and a checksum.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/paging/scratch_file.h"

namespace rilievo {

// 8 bytes of memory per block.
class ScratchBlocks {
 public:
  // `block_bytes`: room for each. `name`: of the file, where it has one; what an earlier run has
  // written to it is there. The errors of ScratchFile, and of CheckRoom() for all blocks.
  static absl::StatusOr<ScratchBlocks> Create(const ScratchFolder& folder, const std::string& name,
                                              int count, int64_t block_bytes);

  int count() const { return static_cast<int>(blocks_.size()); }
  absl::Status Write(int block, std::span<const uint8_t> bytes);
  // Empty where it has not been written. DATA_LOSS when it is not what was written.
  absl::StatusOr<std::vector<uint8_t>> Read(int block) const;
  // As if none were written.
  void Forget() { blocks_.assign(blocks_.size(), {}); }

 private:
  struct Block {
    uint32_t bytes = 0;
    uint32_t checksum = 0;  // CRC-32C
  };
  ScratchBlocks(ScratchFile file, int count, int64_t block_bytes)
      : file_(std::move(file)), block_bytes_(block_bytes), blocks_(static_cast<size_t>(count)) {}
  int64_t PlaceOf(int block) const {
    return block * (block_bytes_ + static_cast<int64_t>(sizeof(Block)));
  }

  ScratchFile file_;
  int64_t block_bytes_;
  std::vector<Block> blocks_;
};

}  // namespace rilievo
