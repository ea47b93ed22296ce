#include "client/cli/output_folder.h"

#include <filesystem>
#include <map>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/formats/file_kind.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace fs = std::filesystem;

absl::Status MakeOutputFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!error || fs::is_directory(path)) return absl::OkStatus();
  return WithExitCode(absl::PermissionDeniedError(
                          absl::StrCat(path, ": cannot be made a folder: ", error.message())),
                      ExitCode::kOutput);
}

bool NamesAFolder(const std::string& path) {
  std::error_code error;
  return absl::EndsWith(path, "/") || fs::is_directory(path, error);
}

absl::StatusOr<std::vector<std::string>> PathsInFolder(const std::vector<std::string>& scans,
                                                       const std::string& folder,
                                                       const std::string& extension) {
  RILIEVO_RETURN_IF_ERROR(MakeOutputFolder(folder));
  std::vector<std::string> paths;
  std::map<std::string, std::string> scan_of;
  for (const std::string& scan : scans) {
    const std::string stem = scan == "-" ? "stdin" : fs::path(NameUnpacked(scan)).stem().string();
    paths.push_back((fs::path(folder) / (stem + extension)).string());
    const auto [other, is_new] = scan_of.emplace(paths.back(), scan);
    if (is_new) continue;
    return UsageError(absl::StrCat(other->second, " and ", scan, " would both become ",
                                   paths.back(), "; give one of them another name"));
  }
  return paths;
}

}  // namespace rilievo
