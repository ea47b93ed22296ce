// Any bytes as an E57 file, as they are and in sound pages.
#include <cstdint>
#include <string>

#include "client/formats/scan_reader.h"
#include "tests/fuzz/read_scan.h"
#include "tests/fuzz/right_page_checksums.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  for (const std::string& file : {bytes, rilievo::WithRightPageChecksums(bytes)}) {
    // A point takes a bit at least.
    rilievo::ReadScanInFull(file, 8 * static_cast<int64_t>(file.size()), &rilievo::ReadE57Scan);
  }
  return 0;
}
