// What the coordinates of a scan stand for, in the words of the protocol.
#pragma once

#include <vector>

#include "core/geometry/scan_place.h"
#include "rilievo/v1/options.pb.h"
#include "server/conversion/call_error.h"

namespace rilievo {

// What is set; fields out of range are among the violations.
ScanPlace ReadPlace(const v1::ScanPlace& from, std::vector<FieldViolation>* violations);

v1::ScanPlace ProtoPlace(const ScanPlace& place);

}  // namespace rilievo
