// A surface moved by many cages: a file for each, or a clip.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"

namespace rilievo {

struct FramesRequest {
  std::string surface;             // its path, for errors
  std::vector<std::string> cages;  // paths, a frame each
  std::optional<double> sharpness;
  std::string output;
  double frames_per_second = 24;
};

struct WrittenFrames {
  int64_t frames = 0, bytes = 0;  // of all files
};

// Each cage as a file of the folder `output`, named as the cage. `kind`: "pose", the first chunk of
// the moved .dss, which the heights of `dss` go with; "dss"; or the extension of a mesh. Errors
// name the cage.
absl::StatusOr<WrittenFrames> WriteFrames(const FramesRequest& request, const std::string& kind,
                                          const std::vector<uint8_t>& dss,
                                          const DecodedSurface& decoded, const RunContext& context);

// Where they go: names of the files of WriteFrames(). The folder is made. kUsage for two of one
// name.
absl::StatusOr<std::vector<std::string>> FrameFiles(const FramesRequest& request,
                                                    const std::string& kind);

// kUsage where a clip of so many morph targets would take more than the 4 GiB of a GLB.
absl::Status CheckClipSize(const std::string& output, int64_t targets, int64_t vertices);

// All cages as one GLB, `output`: the finest mesh of the first, a morph target for each other, and
// an animation through them.
absl::StatusOr<WrittenFrames> WriteClip(const FramesRequest& request, const DecodedSurface& decoded,
                                        const RunContext& context);

}  // namespace rilievo
