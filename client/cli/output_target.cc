#include "client/cli/output_target.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/formats/atomic_file.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

absl::Status UsageError(const std::string& message) {
  return WithExitCode(absl::InvalidArgumentError(message), ExitCode::kUsage);
}

bool NamesAFolder(const std::string& path) {
  std::error_code error;
  return absl::EndsWith(path, "/") || fs::is_directory(path, error);
}

absl::Status MakeFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!error || fs::is_directory(path)) return absl::OkStatus();
  return WithExitCode(absl::PermissionDeniedError(
                          absl::StrCat(path, ": cannot be made a folder: ", error.message())),
                      ExitCode::kOutput);
}

}  // namespace

absl::Status CheckOutputs(const std::vector<std::string>& bytes,
                          const std::vector<std::string>& text) {
  const auto at_standard = std::count_if(bytes.begin(), bytes.end(), IsStandardOutput);
  if (at_standard + std::count_if(text.begin(), text.end(), IsStandardOutput) > 1) {
    return UsageError("two results cannot both go to the standard output; name a file for one");
  }
  if (at_standard > 0 && isatty(STDOUT_FILENO) != 0) {
    return UsageError(
        "-: the standard output is a terminal, which shows no such bytes; name a file, or send "
        "them on with > or |");
  }
  for (const auto* outputs : {&bytes, &text}) {
    for (const std::string& path : *outputs) {
      if (path.empty()) continue;
      RILIEVO_RETURN_IF_ERROR(WithExitCode(CheckWritable(path), ExitCode::kOutput));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckInputs(const std::vector<std::string>& inputs) {
  if (std::count(inputs.begin(), inputs.end(), "-") < 2) return absl::OkStatus();
  return UsageError("the standard input can be read once only; '-' is there twice");
}

std::ostream& WordsBeside(const std::string& output) {
  return IsStandardOutput(output) ? std::cerr : std::cout;
}

absl::Status WriteText(const std::string& path, const std::string& text) {
  return WithExitCode(WriteFileAtomically(path,
                                          [&](std::ostream& out) {
                                            out << text;
                                            return absl::OkStatus();
                                          }),
                      ExitCode::kOutput);
}

absl::StatusOr<std::vector<std::string>> SurfacePaths(const std::vector<std::string>& scans,
                                                      const std::string& output) {
  RILIEVO_RETURN_IF_ERROR(CheckInputs(scans));
  if (!NamesAFolder(output)) {
    if (scans.size() == 1) return std::vector<std::string>{output};
    return UsageError(absl::StrCat("--output ", output, ": ", scans.size(),
                                   " scans need a folder; write ", output, "/"));
  }
  RILIEVO_RETURN_IF_ERROR(MakeFolder(output));
  std::vector<std::string> paths;
  std::map<std::string, std::string> scan_of;
  for (const std::string& scan : scans) {
    const std::string stem = scan == "-" ? "stdin" : fs::path(scan).stem().string();
    paths.push_back((fs::path(output) / (stem + ".dss")).string());
    const auto [other, is_new] = scan_of.emplace(paths.back(), scan);
    if (is_new) continue;
    return UsageError(absl::StrCat(other->second, " and ", scan, " would both become ",
                                   paths.back(), "; reconstruct them one by one"));
  }
  return paths;
}

}  // namespace rilievo
