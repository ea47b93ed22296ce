// Any bytes as a scan of one format; READER is the function that takes them.
#include <cstdint>
#include <string>

#include "client/formats/scan_reader.h"
#include "tests/fuzz/read_scan.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  // No format needs less than two bytes for a point.
  rilievo::ReadScanInFull(std::string(reinterpret_cast<const char*>(data), size),
                          88 * static_cast<int64_t>(size), &rilievo::READER);
  return 0;
}
