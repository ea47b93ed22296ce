// Where the surface of a scan goes: a .dss file, or a mesh of it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace rilievo {

struct SurfaceOutputArguments {
  std::string output;
  bool keep_dss = false;
};

// Adds -o and --keep-dss; `what` says what else -o may be. `arguments` must outlive the command.
CLI::Option* AddSurfaceOutput(CLI::App* app, const std::string& what,
                              SurfaceOutputArguments* arguments);

// The files of one surface.
struct SurfaceTarget {
  std::string path = {};      // as asked for; its extension tells what is written
  std::string kept_dss = {};  // beside it; empty: none

  bool is_mesh() const;
};

// One target. kUsage for an extension that is neither .dss nor that of a mesh, and for --keep-dss
// without a mesh. A path without an extension is a .dss.
absl::StatusOr<SurfaceTarget> SurfaceTargetOf(const SurfaceOutputArguments& arguments);

// The surface of each scan. One scan: SurfaceTargetOf(), unless the output is a folder (it exists,
// or ends with '/'); several: .dss files in the folder, which is made, named as the scans. Errors
// with kUsage: two scans of one name, several scans and no folder, more than one of them the
// standard input.
absl::StatusOr<std::vector<SurfaceTarget>> SurfaceTargets(const std::vector<std::string>& scans,
                                                          const SurfaceOutputArguments& arguments);

// The mesh at the finest level, as `rilievo export` makes it without options.
absl::Status WriteSurfaceMesh(const DecodedSurface& decoded, const std::string& path,
                              const RunContext& context);

// All files that WriteSurface() writes.
std::vector<std::string> PathsOf(const std::vector<SurfaceTarget>& targets);

// The bytes of a .dss as they are, or the mesh that `rilievo export` makes of them. An error has
// the exit code kOutput unless it is that of a cancel.
absl::Status WriteSurface(const SurfaceTarget& target, std::span<const uint8_t> dss,
                          const RunContext& context);

}  // namespace rilievo
