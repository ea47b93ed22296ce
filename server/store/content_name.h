// What a stored file is called: the SHA-256 of its bytes.
#pragma once

#include <cstddef>
#include <string>

#include "core/base/sha256.h"

namespace rilievo {

void AddBytes(const void* data, size_t size, Sha256* hash);

// 64 lower-case hexadecimal digits of all that was added so far; `hash` may go on.
std::string ContentName(Sha256 hash);
std::string ContentNameOf(const std::string& bytes);

// Whether it could be one.
bool IsContentName(const std::string& text);

}  // namespace rilievo
