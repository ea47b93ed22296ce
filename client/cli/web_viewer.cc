#include "client/cli/web_viewer.h"

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/child_program.h"
#include "client/cli/exit_code.h"
#include "client/cli/working_server.h"
#include "core/base/status_macros.h"
#include "server/reconstruction_server.h"
#include "server/worker/in_worker_process.h"
#include "server/worker/worker_process.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

constexpr char kGateway[] = "gateway.mjs";

std::vector<fs::path> Folders() {
  if (const char* named = std::getenv("RILIEVO_WEB"); named != nullptr && *named != '\0') {
    return {named};
  }
  std::error_code error;
  const fs::path programs = fs::read_symlink("/proc/self/exe", error).parent_path();
  return {(programs / "../share/rilievo/web").lexically_normal(),
          (programs / "../web").lexically_normal()};
}

absl::StatusOr<std::string> FindGateway() {
  std::vector<std::string> looked;
  for (const fs::path& folder : Folders()) {
    std::error_code error;
    if (fs::exists(folder / kGateway, error) && fs::exists(folder / "page/index.html", error)) {
      return (folder / kGateway).string();
    }
    looked.push_back(folder.string());
  }
  return absl::FailedPreconditionError(
      absl::StrCat("the page of the viewer is neither in ", absl::StrJoin(looked, " nor in "),
                   "; ./dev web builds it in a clone of the repository, the variable RILIEVO_WEB "
                   "names its folder. Without it `rilievo view IN -o IN.png` draws a picture"));
}

absl::StatusOr<ChildProgram> StartGateway(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {"node"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  absl::StatusOr<ChildProgram> gateway = ChildProgram::Start(words);
  if (!absl::IsNotFound(gateway.status())) return gateway;
  return absl::FailedPreconditionError(
      "the viewer needs Node 18.19 or newer, and there is no program node: apt-get install nodejs. "
      "Without it `rilievo view IN -o IN.png` draws a picture");
}

// A process a job, where the program for that is: one that fails does not take the page along.
JobWork Work() {
  const absl::StatusOr<std::string> worker = WorkerBesideThisProgram();
  absl::StatusOr<JobWork> work =
      worker.ok() ? InWorkerProcess({.program = *worker}) : worker.status();
  return work.ok() ? *std::move(work) : InThisProcess(ReconstructAndDrop);
}

bool Set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

absl::Status ServeWebViewer(const WebViewerOptions& options,
                            const std::function<void(const std::string& url)>& opened,
                            std::stop_token stop) {
  RILIEVO_ASSIGN_OR_RETURN(const std::string gateway, FindGateway());
  ServerOptions limits = LimitsForOneself();
  limits.listen = "127.0.0.1:0";
  limits.store = options.store;
  limits.ephemeral = options.store.empty();
  RILIEVO_ASSIGN_OR_RETURN(const auto server,
                           ReconstructionServer::Listen(limits, Work(), /*log=*/{}));
  std::vector<std::string> words = {gateway,    "--server",     server->address(),
                                    "--listen", options.listen, "--until-input-ends"};
  if (!options.file.empty()) words.insert(words.end(), {"--file", options.file});
  RILIEVO_ASSIGN_OR_RETURN(ChildProgram page, StartGateway(words));

  constexpr std::string_view kSays = "rilievo on ";
  bool told = false;
  while (const std::optional<std::string> line = page.ReadLine(stop)) {
    if (!told && line->substr(0, kSays.size()) == kSays) {
      opened(line->substr(kSays.size()));
      told = true;
    }
  }
  if (stop.stop_requested()) return absl::OkStatus();
  if (told) {
    return absl::UnavailableError(
        "the page is no longer served: its gateway ended by itself; the lines before may say why");
  }
  return absl::UnavailableError(
      absl::StrCat("the page cannot be served on ", options.listen, "; the lines before say why"));
}

bool OpenInBrowser(const std::string& url) {
  if (!Set("DISPLAY") && !Set("WAYLAND_DISPLAY")) return false;
  // Behind a shell: the browser stays when this program ends. The shell prints once it has started
  // xdg-open, for it is ended as soon as it has printed.
  constexpr char kOpen[] =
      "command -v xdg-open >/dev/null && { xdg-open \"$1\" >/dev/null 2>&1 & echo; }";
  absl::StatusOr<ChildProgram> shell = ChildProgram::Start({"sh", "-c", kOpen, "sh", url});
  return shell.ok() && shell->ReadLine(/*stop=*/{}).has_value();
}

}  // namespace rilievo
