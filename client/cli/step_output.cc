#include "client/cli/step_output.h"

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

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

// A file for as long as this lives.
class TemporaryFile {
 public:
  TemporaryFile() {
    std::error_code error;
    path_ = (fs::temp_directory_path(error) / "rilievo-step-XXXXXX").string();
    descriptor_ = mkstemp(path_.data());
  }
  ~TemporaryFile() {
    if (descriptor_ < 0) return;
    close(descriptor_);
    std::error_code error;
    fs::remove(path_, error);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  bool ok() const { return descriptor_ >= 0; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int descriptor_;
};

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
                       double diagonal) {
  RILIEVO_ASSIGN_OR_RETURN(WriteStepFunction* const write, LoadStepLibrary());
  Place(place, shell, &diagonal);
  const TemporaryFile temporary;
  if (!temporary.ok()) {
    return absl::ResourceExhaustedError(absl::StrCat(
        temporary.path(), ": cannot be made; let TMPDIR name a folder that takes files"));
  }
  // What Open CASCADE calls the same place; and as well as coordinates of this size can tell it.
  constexpr double kConfusion = 1e-7, kOfDiagonal = 1e-9;
  std::string problem;
  write(shell,
        {.path = temporary.path(),
         .name = output == "-" ? "surface" : fs::path(output).stem().string(),
         .program = "rilievo " RILIEVO_VERSION,
         .tolerance = std::max(kConfusion, kOfDiagonal * diagonal)},
        &problem);
  if (!problem.empty()) return absl::InternalError(absl::StrCat(output, ": ", problem));
  return WriteFileAtomically(output, [&](std::ostream& out) {
    out << std::ifstream(temporary.path(), std::ios::binary).rdbuf();
    return absl::OkStatus();
  });
}

}  // namespace rilievo
