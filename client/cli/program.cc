#include "client/cli/program.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "server/command_line/help_formatter.h"
#include "server/command_line/text_layout.h"
#include "server/command_line/usage_message.h"

namespace rilievo {
namespace {

// The words of the command line; `help COMMAND` is what `COMMAND --help` is.
std::vector<std::string> GivenWords(const CLI::App& app, int argc, const char* const* argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty() || words.front() != "help") return words;
  words.erase(words.begin());
  // What is not a command is answered as where it stands alone.
  const auto is_meant = [&](const CLI::App* command) { return command->check_name(words.front()); };
  const bool known = words.empty() || !app.get_subcommands(is_meant).empty();
  if (known) words.push_back("--help");
  return words;
}

}  // namespace

int RunProgram(int argc, const char* const* argv) {
  CLI::App app{
      "From a point cloud to a displaced subdivision surface: a smooth surface, and one\n"
      "height at each of its vertices."};
  app.name("rilievo");
  app.set_version_flag("--version", std::string("rilievo ") + RILIEVO_VERSION);
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.footer(
      absl::StrCat("Files are PLY, PCD, XYZ, PTS, TXT, OBJ, LAS, LAZ, E57, PTX (scans), PLY,\n"
                   "OBJ, STL (meshes), .dss (surfaces), each also in gzip or zstd.\n"
                   "'rilievo COMMAND --help' explains one.\n\n",
                   kExitCodeHelp));
  std::vector<Command> commands;
  for (const auto add :
       {AddReconstruct, AddConvert,   AddUpdate,   AddDiagnose,    AddAlign,   AddExport,
        AddInfo,        AddMeasure,   AddEvaluate, AddVoxelize,    AddCombine, AddTrim,
        AddDeform,      AddSubdivide, AddScale,    AddInterpolate, AddVerify,  AddCompare,
        AddSimulate,    AddView,      AddJobs,     AddCompletion,  AddManual}) {
    commands.push_back(add(app));
    commands.back().app->footer(kExitCodeHelp);
  }
  const std::vector<std::string> words = GivenWords(app, argc, argv);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::cerr << UsageMessage(app, words, error);
    return static_cast<int>(ExitCode::kUsage);
  }
  const Interrupt interrupt;
  for (const Command& command : commands) {
    if (!command.app->parsed()) continue;
    absl::Status status = command.run(interrupt.token());
    std::cout.flush();
    if (status.ok() && !std::cout) {
      status = WithExitCode(absl::DataLossError("standard output cannot be written, or not whole"),
                            ExitCode::kOutput);
    }
    if (status.ok()) return 0;
    std::cerr << Wrap(absl::StrCat("rilievo ", command.app->get_name(), ": ",
                                   std::string(status.message())),
                      2)
              << '\n';
    return static_cast<int>(ExitCodeOf(status));
  }
  return static_cast<int>(ExitCode::kUsage);
}

}  // namespace rilievo
