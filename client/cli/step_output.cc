#include "client/cli/step_output.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/formats/atomic_file.h"
#include "client/formats/export_axes.h"
#include "client/step/step_writer.h"
#include "core/base/status_macros.h"
#include "server/conversion/server_options.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

fs::path StepFolder() {
  if (const char* named = std::getenv("RILIEVO_STEP"); named != nullptr && *named != '\0') {
    return named;
  }
  std::error_code error;
  const fs::path programs = fs::read_symlink("/proc/self/exe", error).parent_path();
  return (programs / "../lib/rilievo").lexically_normal();
}

// Once loaded it stays.
absl::StatusOr<WriteStepFunction*> LoadStepLibrary() {
  const std::string path = (StepFolder() / kStepLibrary).string();
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* const reason = dlerror();
    return absl::FailedPreconditionError(absl::StrCat(
        "STEP needs the package rilievo-step, which cannot be loaded (",
        reason == nullptr ? path : reason,
        "). In a clone of the repository: apt-get install libocct-data-exchange-dev, and build "
        "again"));
  }
  const auto* const version = static_cast<const char*>(dlsym(library, kStepVersionSymbol));
  auto* const write = reinterpret_cast<WriteStepFunction*>(dlsym(library, kWriteStepSymbol));
  if (version == nullptr || write == nullptr || std::string_view(version) != RILIEVO_VERSION) {
    return absl::FailedPreconditionError(absl::StrCat(
        path, " is of version ", version == nullptr ? "?" : version,
        ", this program of " RILIEVO_VERSION "; install rilievo-step of the same version"));
  }
  return write;
}

// Millimetres, z up.
void Place(const ScanPlace& place, BicubicShell& shell, double* diagonal) {
  const double scale = place.metres_per_unit > 0 ? 1000 * place.metres_per_unit : 1;
  const Eigen::Matrix3d placed =
      scale * (YUpFrom(UpDirection::kZ).conjugate() * YUpFrom(UpOrZ(place))).toRotationMatrix();
  const auto apply = [&](Eigen::Matrix3Xd& points) { points = placed * points; };
  apply(shell.vertices);
  for (BicubicShell::Edge& edge : shell.edges) apply(edge.control);
  for (BicubicShell::Patch& patch : shell.patches) apply(patch.control);
  *diagonal *= scale;
}

}  // namespace

absl::Status CheckStepLibrary() { return LoadStepLibrary().status(); }

absl::Status WriteStep(const std::string& output, BicubicShell shell, const ScanPlace& place,
                       double diagonal, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(WriteStepFunction* const write, LoadStepLibrary());
  Place(place, shell, &diagonal);
  // What Open CASCADE calls the same place; and as well as coordinates of this size can tell it.
  constexpr double kConfusion = 1e-7, kOfDiagonal = 1e-9;
  const StepFile file = {
      .name = output == "-" ? "surface" : fs::path(output).stem().string(),
      .program = "rilievo " RILIEVO_VERSION,
      .tolerance = std::max(kConfusion, kOfDiagonal * diagonal),
      .stop = context.stop,
  };
  return WriteFileAtomically(output, [&](std::ostream& out) {
    std::string problem;
    write(shell, file, out, &problem);
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (problem.empty()) return absl::OkStatus();
    return absl::InternalError(absl::StrCat(output, ": ", problem));
  });
}

}  // namespace rilievo
