#include "client/cli/deform_frames.h"

#include <filesystem>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/edited_cage.h"
#include "client/cli/exit_code.h"
#include "client/cli/output_folder.h"
#include "client/cli/surface_output.h"
#include "client/formats/atomic_file.h"
#include "client/formats/glb_clip.h"
#include "client/formats/glb_writer.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/deformed_surface.h"
#include "core/codec/container/encode_deformed.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {
namespace {

absl::StatusOr<EditedCage> CageOfFrame(const FramesRequest& request, const std::string& path,
                                       const DecodedSurface& decoded, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  return ReadEditedCage(path, request.surface, decoded.surface.control_mesh, request.sharpness,
                        context);
}

absl::StatusOr<DecodedSurface> SurfaceOfFrame(const FramesRequest& request, const std::string& path,
                                              const DecodedSurface& decoded,
                                              const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const EditedCage cage, CageOfFrame(request, path, decoded, context));
  absl::StatusOr<DecodedSurface> moved = WithControlMesh(decoded, cage.mesh);
  if (!moved.ok()) return AtPath(path, moved.status());
  return moved;
}

int64_t SizeOf(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  return error ? 0 : static_cast<int64_t>(bytes);
}

absl::Status WriteEncoded(const FramesRequest& request, const std::string& cage_path, bool pose,
                          const std::vector<uint8_t>& dss, const DecodedSurface& decoded,
                          const std::string& path, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const EditedCage cage,
                           CageOfFrame(request, cage_path, decoded, context));
  const absl::StatusOr<std::vector<uint8_t>> moved = ReplaceControlMesh(dss, cage.mesh);
  if (!moved.ok()) {
    const bool of_surface = absl::IsFailedPrecondition(moved.status());
    return AtPath(of_surface ? request.surface : cage_path, moved.status());
  }
  std::span<const uint8_t> bytes = *moved;
  if (pose) {
    RILIEVO_ASSIGN_OR_RETURN(const ChunkList list, ListChunks(bytes, /*check=*/false));
    bytes = bytes.first(static_cast<size_t>(list.chunks.front().bytes));
  }
  return WithExitCode(WriteBytesAtomically(path, bytes), ExitCode::kOutput);
}

}  // namespace

absl::StatusOr<std::vector<std::string>> FrameFiles(const FramesRequest& request,
                                                    const std::string& kind) {
  return PathsInFolder(request.cages, request.output,
                       kind == "pose" ? ".pose.dss" : absl::StrCat(".", kind));
}

absl::StatusOr<WrittenFrames> WriteFrames(const FramesRequest& request, const std::string& kind,
                                          const std::vector<uint8_t>& dss,
                                          const DecodedSurface& decoded,
                                          const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<std::string> files, FrameFiles(request, kind));
  WrittenFrames written;
  for (size_t i = 0; i < files.size(); ++i) {
    if (kind == "pose" || kind == "dss") {
      RILIEVO_RETURN_IF_ERROR(
          WriteEncoded(request, request.cages[i], kind == "pose", dss, decoded, files[i], context));
    } else {
      RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface moved,
                               SurfaceOfFrame(request, request.cages[i], decoded, context));
      RILIEVO_RETURN_IF_ERROR(WriteSurfaceMesh(moved, files[i], context));
    }
    ++written.frames;
    written.bytes += SizeOf(files[i]);
  }
  return written;
}

absl::Status CheckClipSize(const std::string& output, int64_t targets, int64_t vertices) {
  constexpr int64_t kBytesOfVertex = 2 * 3 * sizeof(float);  // position and normal
  constexpr int64_t kMost = int64_t{1} << 32;
  if (vertices == 0 || targets <= kMost / kBytesOfVertex / vertices) return absl::OkStatus();
  return UsageError(absl::StrCat(
      output, ": ", targets + 1, " cages of ", vertices, " vertices need ", kBytesOfVertex,
      " bytes a vertex and cage, more than the 4 GiB that a .glb holds; give fewer of the cages, "
      "or write a file for each into a folder (--output DIR/ --frames glb)"));
}

absl::StatusOr<WrittenFrames> WriteClip(const FramesRequest& request, const DecodedSurface& decoded,
                                        const RunContext& context) {
  const int level = decoded.surface.max_level;
  TriangleMesh first;
  GlbClip clip;
  clip.frames_per_second = request.frames_per_second;
  for (size_t i = 0; i < request.cages.size(); ++i) {
    RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface moved,
                             SurfaceOfFrame(request, request.cages[i], decoded, context));
    RILIEVO_ASSIGN_OR_RETURN(TriangleMesh mesh, Tessellate(moved.surface, level, context));
    if (i == 0) {
      const auto targets = static_cast<int64_t>(request.cages.size()) - 1;
      RILIEVO_RETURN_IF_ERROR(CheckClipSize(request.output, targets, mesh.vertices.cols()));
      first = std::move(mesh);
      continue;
    }
    clip.frames.push_back({(mesh.vertices - first.vertices).cast<float>(),
                           (mesh.normals - first.normals).cast<float>()});
  }
  PointLayers layers;
  layers.colors = decoded.surface.colors;
  absl::Status status = WriteFileAtomically(request.output, [&](std::ostream& out) {
    return WriteGlbMesh(first, SourcesAtLevel(decoded.surface, level), out, layers,
                        decoded.metadata.place, nullptr, &clip);
  });
  RILIEVO_RETURN_IF_ERROR(WithExitCode(std::move(status), ExitCode::kOutput));
  return WrittenFrames{static_cast<int64_t>(request.cages.size()), SizeOf(request.output)};
}

}  // namespace rilievo
