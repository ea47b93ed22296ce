// Which parts of a step of a run are finished.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/paging/scratch_file.h"

namespace rilievo {

class PartJournal {
 public:
  // `name`: of its file. With the entries that an earlier run has left in the folder. The errors of
  // ScratchFile.
  static absl::StatusOr<PartJournal> Open(const ScratchFolder& folder, const std::string& name);

  // By part, the checksum that Add() was given.
  const std::map<int, uint64_t>& finished() const { return finished_; }
  // All that the part has written is there.
  absl::Status Add(int part, uint64_t checksum);

 private:
  explicit PartJournal(ScratchFile file) : file_(std::move(file)) {}

  ScratchFile file_;
  std::map<int, uint64_t> finished_;
};

}  // namespace rilievo
