#include "client/cli/surface_call.h"

#include <chrono>
#include <optional>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/cli/report_output.h"
#include "client/cli/server_words.h"
#include "core/paging/scratch_file.h"

namespace rilievo {

ReconstructCallbacks ShowProgress(int64_t points, bool remote, TimeLeft* left,
                                  ProgressDisplay* display) {
  ReconstructCallbacks callbacks;
  if (remote) {
    callbacks.sent = [=](int64_t sent) {
      display->Update(0, v1::Stage_MAX - v1::STAGE_CHECK + 1, "sending",
                      static_cast<double>(sent) / static_cast<double>(points));
    };
  }
  const auto start = std::chrono::steady_clock::now();
  callbacks.progress = [=](const v1::Progress& progress) {
    if (progress.stage() < v1::STAGE_CHECK) return;
    std::optional<double> seconds;
    if (left != nullptr) {
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      seconds = left->After(progress.stage(), progress.fraction(), elapsed.count());
    }
    display->Update(progress.stage() - v1::STAGE_CHECK + 1, v1::Stage_MAX - v1::STAGE_CHECK + 1,
                    StageLabel(progress.stage()), progress.fraction(),
                    seconds ? TimeLeftText(*seconds) : "");
  };
  return callbacks;
}

absl::Status Explain(const absl::Status& status, const std::string& input,
                     const std::string& server) {
  std::string message = WordsOf(status);
  if (status.code() == absl::StatusCode::kUnavailable && !server.empty()) {
    message = absl::StrCat("the server at ", server, " is unavailable: ", message,
                           "\nIs rilievod running there? Without --server the work is done here.");
  } else if (status.code() == absl::StatusCode::kCancelled) {
    message = "cancelled; nothing was written";
  } else if (status.code() != absl::StatusCode::kResourceExhausted) {
    message = absl::StrCat(input, ": ", message);
  }
  // Without a server it is the scan that asks for too much.
  const bool too_much = status.code() == absl::StatusCode::kResourceExhausted && server.empty();
  const absl::Status explained = WithMessage(status, message);
  if (IsOfScratchFolder(status)) return WithExitCode(explained, ExitCode::kOutput);
  return too_much ? WithExitCode(explained, ExitCode::kInput) : explained;
}

}  // namespace rilievo
