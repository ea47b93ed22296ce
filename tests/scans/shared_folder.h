// The folder of shared scans, which are not part of the repository.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace rilievo {

// Named by the environment, else beside the source tree; it may not be there.
inline std::filesystem::path SharedData() {
  if (const char* named = std::getenv("RILIEVO_SHARED")) {
    return std::filesystem::path(named) / "data";
  }
  const auto source = std::filesystem::path(__FILE__).parent_path() / "../../..";
  return (source / "shared/data").lexically_normal();
}

// Samples of file formats.
inline std::filesystem::path SharedFormats() { return SharedData() / "formats"; }

}  // namespace rilievo
