#include "server/store/temporary_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/folder.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

constexpr char kPrefix[] = "rilievod-ephemeral-";
constexpr char kNewPrefix[] = "rilievod-new-";

// The folder of a server that runs is locked.
void RemoveLeftBehind(const fs::path& base) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(base, error)) {
    struct stat folder {};
    if (!absl::StartsWith(entry.path().filename().string(), kPrefix) ||
        lstat(entry.path().c_str(), &folder) != 0 || !S_ISDIR(folder.st_mode) ||
        folder.st_uid != geteuid() || !fs::exists(entry.path() / "lock", error)) {
      continue;
    }
    if (LockFolder(entry.path().string()).ok()) fs::remove_all(entry.path(), error);
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<TemporaryFolder>> TemporaryFolder::Make() {
  std::error_code error;
  const fs::path base = fs::temp_directory_path(error);
  std::string made = (base / absl::StrCat(kNewPrefix, "XXXXXX")).string();
  if (error || mkdtemp(made.data()) == nullptr) {
    return absl::UnavailableError(
        "--ephemeral needs a folder for temporary files that can be written: set TMPDIR, or mount "
        "one at /tmp");
  }
  RILIEVO_ASSIGN_OR_RETURN(FileDescriptor lock, LockFolder(made));
  // Only now: one of that name which is not locked was left behind.
  std::string name = (base / absl::StrCat(kPrefix, made.substr(made.size() - 6))).string();
  fs::rename(made, name, error);
  if (error) {
    fs::remove_all(made, error);
    return absl::UnavailableError(absl::StrCat("--ephemeral cannot make ", name));
  }
  RemoveLeftBehind(base);
  return std::unique_ptr<TemporaryFolder>(new TemporaryFolder(std::move(name), std::move(lock)));
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  fs::remove_all(outer_, error);
}

}  // namespace rilievo
