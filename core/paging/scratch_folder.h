// Where the files of a run lie: without names, or kept for a run that goes on where it ended.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

class ScratchFolder {
 public:
  // Files without names: they go with the process, however that ends.
  ScratchFolder(std::string path) : path_(std::move(path)) {}  // NOLINT: stands for its path
  // Named files that stay, in a folder that is there: see KeptScratch. PERMISSION_DENIED where
  // `path` is a symbolic link, belongs to another user, or others may write to it; the errors of
  // ScratchFile.
  static absl::StatusOr<ScratchFolder> Kept(const std::string& path);
  // For a process that may open no files: these, which are open and empty, are its files, each
  // once. `path`: where they are, in messages.
  static ScratchFolder OfFiles(std::string path, std::vector<int> numbers);

  const std::string& path() const { return path_; }
  bool keeps() const { return open_ != nullptr; }
  // Its files without names, whether it keeps others or not.
  ScratchFolder WithoutNames() const;
  // The number of a new file without a name, or -1, and errno then. Of a folder that does not keep.
  int MakeFile() const;
  // A file in it that is none but its user's: NAME itself, and no link that leads elsewhere. Its
  // number, or -1, and errno then. `flags`: of open().
  int OpenFile(const std::string& name, int flags) const;

  // Puts something finished there, whole or not at all; nothing where files have no names. The
  // errors of ScratchFile.
  absl::Status Save(const std::string& name, std::span<const uint8_t> bytes) const;
  // What was saved last; unset where there is nothing, or it is damaged.
  std::optional<std::vector<uint8_t>> Load(const std::string& name) const;

 private:
  std::string path_;
  // The number of the folder, so that no other one takes its place; null: files have no names.
  std::shared_ptr<const int> open_;
  std::shared_ptr<std::vector<int>> files_;  // those of OfFiles() that are left; null: none given
};

// A folder of its own for one run, told from others by its identity. Another process that runs the
// same finds in it what an earlier one has finished.
class KeptScratch {
 public:
  // In `path`. `identity`: all that the files depend on. FAILED_PRECONDITION while another process
  // works there; the errors of ScratchFolder::Kept().
  static absl::StatusOr<KeptScratch> Open(const std::string& path, const std::string& identity);
  KeptScratch(KeptScratch&& other) noexcept
      : folder_(std::move(other.folder_)), lock_(std::exchange(other.lock_, -1)) {}
  KeptScratch& operator=(KeptScratch&&) = delete;
  ~KeptScratch();

  const ScratchFolder& folder() const { return folder_; }
  // The run is done: all its files go.
  void Remove();

 private:
  KeptScratch(ScratchFolder folder, int lock) : folder_(std::move(folder)), lock_(lock) {}

  ScratchFolder folder_;
  int lock_;
};

}  // namespace rilievo
