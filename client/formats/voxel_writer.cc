#include "client/formats/voxel_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <ostream>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/atomic_file.h"
#include "client/formats/number_text.h"
#include "client/formats/voxel_writer_vdb.h"
#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kWordsAtOnce = size_t{1} << 15;  // 2 MB of numbers
constexpr int kSlabsPerThread = 2;                // of distances

// The eight numbers 0 or 1 of each byte.
std::array<std::array<char, 8>, 256> NumbersOfBytes() {
  std::array<std::array<char, 8>, 256> numbers{};
  for (size_t byte = 0; byte < 256; ++byte) {
    for (size_t bit = 0; bit < 8; ++bit) numbers[byte][bit] = static_cast<char>(byte >> bit & 1);
  }
  return numbers;
}

std::string NumbersOfWords(const uint64_t* words, size_t count) {
  static const std::array<std::array<char, 8>, 256> kNumbers = NumbersOfBytes();
  std::string bytes(64 * count, '\0');
  for (size_t w = 0; w < count; ++w) {
    for (size_t part = 0; part < 8; ++part) {
      const std::array<char, 8>& eight = kNumbers[words[w] >> (8 * part) & 0xff];
      std::memcpy(bytes.data() + 64 * w + 8 * part, eight.data(), 8);
    }
  }
  return bytes;
}

std::string VectorText(double x, double y, double z) {
  std::string text = "(";
  AppendNumber(x, &text);
  text += ',';
  AppendNumber(y, &text);
  text += ',';
  AppendNumber(z, &text);
  return text + ')';
}

// http://teem.sourceforge.net/nrrd/format.html
std::string NrrdHeader(const VoxelValues& values, const std::string& unit) {
  const VoxelGrid& grid = values.grid;
  const double voxel = grid.voxel;
  const Eigen::Vector3d first = grid.CenterOf(0, 0, 0);
  std::string header = absl::StrCat(
      "NRRD0004\ncontent: ", values.content, "\ntype: ", values.type,
      "\ndimension: 3\nspace dimension: 3\nsizes: ", grid.size.x(), " ", grid.size.y(), " ",
      grid.size.z(), "\nspace directions: ", VectorText(voxel, 0, 0), " ", VectorText(0, voxel, 0),
      " ", VectorText(0, 0, voxel), "\nspace origin: ", VectorText(first.x(), first.y(), first.z()),
      "\nkinds: domain domain domain\ncenterings: cell cell cell\n");
  if (!unit.empty()) {
    absl::StrAppend(&header, "space units: \"", unit, "\" \"", unit, "\" \"", unit, "\"\n");
  }
  if (values.bytes > 1) {
    absl::StrAppend(
        &header, "endian: ", std::endian::native == std::endian::little ? "little" : "big", "\n");
  }
  return header + "encoding: raw\n\n";
}

}  // namespace

VoxelValues ValuesOf(const VoxelBits& bits, std::string content, const RunContext& context) {
  return {bits.grid, std::move(content), "uint8", 1,
          [&bits, context, at = size_t{0},
           numbers = std::string()]() mutable -> absl::StatusOr<std::string_view> {
            RILIEVO_RETURN_IF_ERROR(context.CheckStop());
            const size_t count = std::min(kWordsAtOnce, bits.words.size() - at);
            numbers = NumbersOfWords(bits.words.data() + at, count);
            at += count;
            return numbers;
          }};
}

VoxelValues ValuesOf(const VoxelDistances& distances, std::string content,
                     const RunContext& context) {
  const int at_once = context.ThreadCount() * kSlabsPerThread * VoxelDistances::kSlab;
  VoxelValues values{distances.grid(), std::move(content), "float", sizeof(float),
                     [&distances, context, at_once, at = 0,
                      layers = std::vector<float>()]() mutable -> absl::StatusOr<std::string_view> {
                       FreeMemoryOf(&layers);  // before there are the next ones
                       const int count = std::min(at_once, distances.grid().size.z() - at);
                       RILIEVO_ASSIGN_OR_RETURN(layers, distances.Layers(at, count, context));
                       at += count;
                       return std::string_view(reinterpret_cast<const char*>(layers.data()),
                                               layers.size() * sizeof(float));
                     }};
  values.name = distances.is_signed() ? "surface" : "distance";
  values.grid_class = distances.is_signed() ? "level set" : "unknown";
  values.background = static_cast<float>(distances.band());
  return values;
}

absl::Status WriteVoxels(const std::string& path, const std::string& extension,
                         const VoxelValues& values, const std::string& unit,
                         const std::function<void(double share)>& progress) {
  if (extension != "nrrd" && extension != "raw" && extension != "vdb") {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": the extension must be .nrrd, .raw or .vdb"));
  }
  return WriteFileAtomically(path, [&](std::ostream& out) -> absl::Status {
    if (extension == "vdb") return WriteVdb(values, progress, out);
    if (extension == "nrrd") out << NrrdHeader(values, unit);
    const int64_t all = values.grid.count() * values.bytes;
    for (int64_t written = 0; written < all && out;) {
      RILIEVO_ASSIGN_OR_RETURN(const std::string_view bytes, values.next());
      const int64_t count = std::min(all - written, static_cast<int64_t>(bytes.size()));
      out.write(bytes.data(), count);  // the last bits of a grid fill no word
      written += count;
      if (progress) progress(static_cast<double>(written) / static_cast<double>(all));
    }
    return absl::OkStatus();
  });
}

}  // namespace rilievo
