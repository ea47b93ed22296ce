// The subcommands of `rilievo`. Each adds its options to the program and gives what to run when it
// was chosen.
#pragma once

#include <functional>
#include <stop_token>

#include "absl/status/status.h"

namespace CLI {
class App;
}

namespace rilievo {

// `stop`: Ctrl-C. What people asked for goes to standard output, progress to standard error, errors
// into the status (see exit_code.h).
using CommandAction = std::function<absl::Status(std::stop_token stop)>;

struct Command {
  CLI::App* app;  // owned by the program
  CommandAction run;
};

Command AddReconstruct(CLI::App& program);
Command AddAlign(CLI::App& program);
Command AddCombine(CLI::App& program);
Command AddCompletion(CLI::App& program);
Command AddConvert(CLI::App& program);
Command AddDeform(CLI::App& program);
Command AddDiagnose(CLI::App& program);
Command AddEvaluate(CLI::App& program);
Command AddExport(CLI::App& program);
Command AddInfo(CLI::App& program);
Command AddInterpolate(CLI::App& program);
Command AddJobs(CLI::App& program);
Command AddManual(CLI::App& program);
Command AddMeasure(CLI::App& program);
Command AddCompare(CLI::App& program);
Command AddScale(CLI::App& program);
Command AddSimulate(CLI::App& program);
Command AddSubdivide(CLI::App& program);
Command AddTrim(CLI::App& program);
Command AddUpdate(CLI::App& program);
Command AddVerify(CLI::App& program);
Command AddVoxelize(CLI::App& program);
Command AddView(CLI::App& program);

}  // namespace rilievo
