// The type of a status' payloads; no status has any here.
#pragma once

namespace absl {

class Cord {};

}  // namespace absl
