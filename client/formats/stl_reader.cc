#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/byte_source.h"
#include "client/formats/mesh_reader.h"
#include "client/formats/number_text.h"
#include "client/formats/scalar_type.h"
#include "client/formats/vertex_welder.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

// STL repeats each corner; equal ones are one vertex.
class CornerWelder {
 public:
  void Add(double x, double y, double z) { indices_.push_back(vertices_.Add(x, y, z)); }

  size_t corners() const { return indices_.size(); }

  TriangleMesh Finish() {
    TriangleMesh mesh;
    mesh.vertices = vertices_.Finish();
    mesh.triangles = Eigen::Map<const Eigen::Matrix3Xi>(
        indices_.data(), 3, static_cast<Eigen::Index>(indices_.size() / 3));
    return mesh;
  }

 private:
  VertexWelder vertices_;
  std::vector<int> indices_;
};

constexpr size_t kStlHeader = 80, kStlTriangle = 50;

absl::Status ReadBinaryStl(ByteSource* source, CornerWelder* corners) {
  const char* head = source->Take(kStlHeader + 4);
  if (head == nullptr) return absl::DataLossError("STL: shorter than its 84-byte header");
  const uint64_t count = LoadAs<uint32_t>(head + kStlHeader, kSwapLittle);
  if (!source->MayHold(count * kStlTriangle)) {
    return absl::DataLossError(absl::StrCat("STL: the header claims ", count, " triangles, the ",
                                            *source->remaining(), " bytes left hold ",
                                            *source->remaining() / kStlTriangle));
  }
  for (uint64_t i = 0; i < count; ++i) {
    const char* bytes = source->Take(kStlTriangle);
    if (bytes == nullptr) return absl::DataLossError(absl::StrCat("STL: ends in triangle ", i + 1));
    for (size_t corner = 0; corner < 3; ++corner) {
      const char* at = bytes + 12 + 12 * corner;  // after the normal
      corners->Add(LoadAs<float>(at, kSwapLittle), LoadAs<float>(at + 4, kSwapLittle),
                   LoadAs<float>(at + 8, kSwapLittle));
    }
  }
  return absl::OkStatus();
}

absl::Status ReadAsciiStl(ByteSource* source, CornerWelder* corners) {
  std::string_view line;
  for (;;) {
    const ByteSource::Line result = source->NextLine(&line);
    const auto error = [&](const auto&... what) {
      return absl::InvalidArgumentError(
          absl::StrCat("STL, line ", source->line_number(), ": ", what...));
    };
    if (result == ByteSource::Line::kEnd) {
      return absl::DataLossError("STL: the bytes end before 'endsolid'; truncated file?");
    }
    if (result == ByteSource::Line::kTooLong) return error("the next line is over 1 MiB");
    const std::string_view word = NextWord(&line);
    if (word == "endsolid") return absl::OkStatus();
    if (word == "vertex") {
      std::array<double, 3> point;
      for (double& coordinate : point) {
        const absl::Status status = ParseNumber(NextWord(&line), &coordinate);
        if (!status.ok()) return error(status.message());
      }
      corners->Add(point[0], point[1], point[2]);
    } else if (word == "endfacet" && corners->corners() % 3 != 0) {
      return error("a facet that has not three vertices");
    }
  }
}

}  // namespace

absl::StatusOr<MeshFile> ReadStlMesh(std::istream& in) {
  ByteSource source(in);
  const std::string_view head = source.Peek(4096);
  const bool ascii = head.substr(0, 5) == "solid" && head.find("facet") != std::string_view::npos;
  CornerWelder corners;
  RILIEVO_RETURN_IF_ERROR(ascii ? ReadAsciiStl(&source, &corners)
                                : ReadBinaryStl(&source, &corners));
  if (corners.corners() == 0 || corners.corners() % 3 != 0) {
    return absl::InvalidArgumentError("STL: no triangles");
  }
  MeshFile file;
  file.mesh = corners.Finish();
  file.format = ascii ? "STL ascii" : "STL binary";
  return file;
}

}  // namespace rilievo
