// The XML section of an E57 file as a tree.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo::e57 {

struct XmlElement {
  std::string name;  // with its prefix, as in the file
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string text;  // all of it, character data and CDATA sections, without that of the children
  std::vector<XmlElement> children;

  // The first one of this name, or nullptr.
  const XmlElement* Child(std::string_view child) const;
  const std::string* Attribute(std::string_view attribute) const;
};

// The root element of `text`, UTF-8. This is the part of XML 1.0 (W3C, fifth edition) that E57
// writers use; no XML library, because the page's WebAssembly module reads E57 files too, and
// Debian has none compiled for it. There are no document types and no entities but the five of
// XML's own, so nothing expands and nothing outside is read; what follows the root is
// ignored. INVALID_ARGUMENT, with the line, for anything else, and for more than 64 nested elements
// or two million elements and attributes, which bounds the memory.
absl::StatusOr<XmlElement> ParseXml(std::string_view text);

}  // namespace rilievo::e57
