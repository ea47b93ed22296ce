// rilievo completion, and the manual pages.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "client/cli/command_outline.h"
#include "client/cli/commands.h"
#include "client/cli/completion_script.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/manual_page.h"
#include "core/base/status_macros.h"

namespace rilievo {

Command AddCompletion(CLI::App& program) {
  CLI::App* app = program.add_subcommand("completion", "Print what a shell needs to complete");
  const auto shell = std::make_shared<std::string>();
  app->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  return {app, [shell, &program](std::stop_token) {
            const auto commands = OutlineOf(program);
            std::cout << (*shell == "bash"  ? BashCompletion(commands)
                          : *shell == "zsh" ? ZshCompletion(commands)
                                            : FishCompletion(commands));
            return absl::OkStatus();
          }};
}

Command AddManual(CLI::App& program) {
  CLI::App* app = program.add_subcommand("manual", "Print a manual page in the language of man(7)");
  app->group("");  // of use to packages only: not in --help
  const auto server_help = std::make_shared<std::string>();
  app->add_option("--of-server", *server_help,
                  "the page of rilievod, from this file that `rilievod --help` wrote");
  return {app, [server_help, &program](std::stop_token) -> absl::Status {
            if (server_help->empty()) {
              std::cout << ManualOfProgram(OutlineOf(program));
              return absl::OkStatus();
            }
            RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> help, ReadBytes(*server_help));
            std::cout << ManualOfServer({reinterpret_cast<const char*>(help.data()), help.size()});
            return absl::OkStatus();
          }};
}

}  // namespace rilievo
