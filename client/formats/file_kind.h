// What a file is, by its first bytes and its name.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace rilievo {

enum class FileKind { kPly, kPcd, kXyz, kObj, kStl, kGlb, kLas, kE57, kPtx, kDss };

// How much of the start RecognizeFile wants to see.
inline constexpr size_t kHeadBytes = 4096;

// `head`: the first kHeadBytes, or all there are; `size`: of the file, 0 if unknown; `name`: its
// name, for the extension (that before .gz or .zst). INVALID_ARGUMENT for an empty file, for a
// well-known format that is not read here (with what to do), and for a file that neither content
// nor extension explains.
absl::StatusOr<FileKind> RecognizeFile(std::string_view head, uint64_t size,
                                       const std::string& name);

// Compressed as a whole.
enum class Packing { kGzip, kZstd };

// By the first bytes; nullopt for what is not compressed.
std::optional<Packing> PackingOf(std::string_view head);

// The name of what a compressed file holds: without .gz or .zst at its end.
std::string NameUnpacked(const std::string& name);

// Lower-case extension without the dot; empty if there is none.
std::string Extension(const std::string& name);

}  // namespace rilievo
