#include "client/formats/file_kind.h"

#include <bit>
#include <filesystem>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"
#include "client/formats/scalar_type.h"
#include "client/formats/xyz_heading.h"

namespace rilievo {
namespace {

using std::string_view;

constexpr string_view kGzipMagic = "\x1f\x8b", kZstdMagic = "\x28\xb5\x2f\xfd";

struct Foreign {
  string_view magic;
  const char* what;
};

constexpr Foreign kForeign[] = {
    {"\x89PNG", "a PNG picture, not a scan"},
    {"\xff\xd8\xff", "a JPEG picture, not a scan"},
    {"PK\x03\x04", "a ZIP archive; unpack it first"},
    {kGzipMagic, "gzip-compressed; unpack it first (gunzip)"},
    {kZstdMagic, "zstd-compressed; unpack it first (unzstd)"},
    {"OFF", "an OFF file, which is not supported; convert it to PLY"},
    {"\x7f"
     "ELF",
     "a program, not a scan"},
};

bool StartsWith(string_view text, string_view prefix) {
  return text.substr(0, prefix.size()) == prefix;
}

string_view FirstWord(string_view line) { return NextWord(&line); }

// The first line that is neither blank nor a comment.
string_view FirstDataLine(string_view head) {
  while (!head.empty()) {
    const size_t end = head.find('\n');
    const string_view line = head.substr(0, end);
    head.remove_prefix(end == string_view::npos ? head.size() : end + 1);
    const string_view word = FirstWord(line);
    if (!word.empty() && word.front() != '#' && !StartsWith(word, "//")) return line;
  }
  return {};
}

bool IsPcd(string_view head, string_view first_word) {
  if (StartsWith(head, "# .PCD")) return true;
  return first_word == "VERSION" || first_word == "FIELDS" || first_word == "COLUMNS";
}

bool IsStl(string_view head, uint64_t size) {
  if (head.size() >= 84) {
    const bool big_endian_host = std::endian::native == std::endian::big;
    const uint64_t triangles = LoadAs<uint32_t>(head.data() + 80, big_endian_host);
    if (size > 0 && size == 84 + 50 * triangles) return true;
  }
  return StartsWith(head, "solid") && head.find("facet") != string_view::npos;
}

std::optional<FileKind> ByExtension(const std::string& extension) {
  if (extension == "ply") return FileKind::kPly;
  if (extension == "pcd") return FileKind::kPcd;
  if (extension == "obj") return FileKind::kObj;
  if (extension == "stl") return FileKind::kStl;
  if (extension == "glb") return FileKind::kGlb;
  if (extension == "las" || extension == "laz") return FileKind::kLas;
  if (extension == "e57") return FileKind::kE57;
  if (extension == "ptx") return FileKind::kPtx;
  if (extension == "dss") return FileKind::kDss;
  for (const char* text : {"xyz", "pts", "txt", "csv", "asc", "xyzn", "xyzrgb"}) {
    if (extension == text) return FileKind::kXyz;
  }
  return std::nullopt;
}

bool LooksLikeNumbers(string_view line) {
  if (line.find('\0') != string_view::npos) return false;
  const size_t begin = line.find_first_not_of(" \t,;");
  if (begin == string_view::npos) return false;
  const string_view word = line.substr(begin);
  double value;
  return ParseNumber(word.substr(0, word.find_first_of(" \t,;\r")), &value).ok();
}

// Two counts, four rows of three numbers, four of four: PTX, and no PTS, whose rows are alike.
bool LooksLikePtx(string_view head) {
  for (const int expected : {1, 1, 3, 3, 3, 3, 4, 4, 4, 4}) {
    const size_t end = head.find('\n');
    if (end == string_view::npos) return false;
    string_view line = head.substr(0, end);
    head.remove_prefix(end + 1);
    int numbers = 0;
    for (string_view word = NextWord(&line); !word.empty(); word = NextWord(&line)) {
      double value;
      if (!ParseNumber(word, &value).ok()) return false;
      ++numbers;
    }
    if (numbers != expected) return false;
  }
  return true;
}

}  // namespace

std::optional<Packing> PackingOf(string_view head) {
  if (StartsWith(head, kGzipMagic)) return Packing::kGzip;
  if (StartsWith(head, kZstdMagic)) return Packing::kZstd;
  return std::nullopt;
}

std::string NameUnpacked(const std::string& name) {
  const std::string extension = Extension(name);
  if (extension != "gz" && extension != "zst") return name;
  return name.substr(0, name.size() - extension.size() - 1);
}

std::string Extension(const std::string& name) {
  const std::string extension = std::filesystem::path(name).extension().string();
  return absl::AsciiStrToLower(extension.empty() ? "" : extension.substr(1));
}

absl::StatusOr<FileKind> RecognizeFile(string_view head, uint64_t size, const std::string& name) {
  if (head.empty()) return absl::InvalidArgumentError("the file is empty");
  for (const Foreign& foreign : kForeign) {
    if (StartsWith(head, foreign.magic)) {
      return absl::InvalidArgumentError(absl::StrCat("this is ", foreign.what));
    }
  }
  if (StartsWith(head, "ply\n") || StartsWith(head, "ply\r")) return FileKind::kPly;
  if (StartsWith(head,
                 "\x89"
                 "DSS\r\n"))
    return FileKind::kDss;
  if (StartsWith(head, "glTF")) return FileKind::kGlb;
  if (StartsWith(head, "LASF")) return FileKind::kLas;
  if (StartsWith(head, "ASTM-E57")) return FileKind::kE57;
  head = WithoutByteOrderMark(head);
  const string_view line = FirstDataLine(head);
  const string_view word = FirstWord(line);
  if (IsPcd(head, word)) return FileKind::kPcd;
  if (IsStl(head, size)) return FileKind::kStl;
  const std::optional<FileKind> named = ByExtension(Extension(NameUnpacked(name)));
  if (named) return *named;
  if (word == "v") return FileKind::kObj;
  if (LooksLikePtx(head)) return FileKind::kPtx;
  if (!line.empty() && (LooksLikeNumbers(line) || ParseXyzHeading(line))) return FileKind::kXyz;
  return absl::InvalidArgumentError(
      "neither content nor extension is that of a known format (PLY, PCD, XYZ, PTS, TXT, OBJ, LAS, "
      "LAZ, E57, PTX, STL, GLB, DSS)");
}

}  // namespace rilievo
