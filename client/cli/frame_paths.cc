#include "client/cli/frame_paths.h"

#include <filesystem>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/exit_code.h"

namespace rilievo {

absl::StatusOr<std::vector<std::string>> FramePaths(const std::string& output, int frames) {
  std::string pattern = output;
  if (absl::EndsWith(output, "/")) {
    std::error_code error;
    std::filesystem::create_directories(output, error);
    pattern += "frame-%03d.png";
  }
  std::vector<std::string> paths;
  const size_t begin = pattern.find('%');
  if (begin == std::string::npos) return paths;
  const size_t end = pattern.find('d', begin);
  const std::string digits =
      end == std::string::npos ? "" : pattern.substr(begin + 1, end - begin - 1);
  int width = 0;
  if (end == std::string::npos || (!digits.empty() && !absl::SimpleAtoi(digits, &width)) ||
      width < 0 || width > 9 || pattern.find('%', end) != std::string::npos) {
    return WithExitCode(
        absl::InvalidArgumentError(
            absl::StrCat("--output ", output, ": numbered pictures are written as turn-%03d.png")),
        ExitCode::kUsage);
  }
  for (int i = 0; i < frames; ++i) {
    paths.push_back(absl::StrCat(pattern.substr(0, begin), absl::StrFormat("%0*d", width, i),
                                 pattern.substr(end + 1)));
  }
  return paths;
}

}  // namespace rilievo
