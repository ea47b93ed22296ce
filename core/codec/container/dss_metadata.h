// The optional fields at the end of a .dss header.
#pragma once

#include "core/codec/bytes/byte_stream.h"
#include "core/codec/container/dss.h"

namespace rilievo {

// Fields of number, length and bytes, ended by a 0 in place of a number.
void WriteMetadata(const DssMetadata& metadata, ByteWriter& writer);

// Skips the numbers it does not know. Version 1 wrote its two doubles whole, which reads the same.
DssMetadata ReadMetadata(ByteReader& reader);

}  // namespace rilievo
