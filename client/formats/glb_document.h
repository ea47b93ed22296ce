// A binary glTF 2.0 file taken apart: its JSON, and its accessors as rows of numbers.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/statusor.h"
#include "client/formats/byte_source.h"
#include "client/formats/scalar_type.h"

namespace rilievo {

// The rows of an accessor, all of which lie within the bytes of the file.
struct GlbRows {
  const char* bytes = nullptr;  // of the first row
  size_t stride = 0;            // bytes from a row to the next
  uint64_t count = 0;           // >= 1
  ScalarType type = ScalarType::kF32;
  size_t width = 0;  // values a row, 1 to 4
  bool normalized = false;

  // `row` < count, `column` < width. Value: a normalized integer is not yet divided.
  double Value(uint64_t row, size_t column) const;
  double Real(uint64_t row, size_t column) const;
};

class GlbDocument {
 public:
  using Json = nlohmann::json;

  // Uses the bytes in `source`, which must outlive the document and is not to be read on meanwhile.
  // The JSON may have 16 MiB and a million values. INVALID_ARGUMENT for other bytes than those of
  // GLB 2 and for required extensions that change the geometry but KHR_mesh_quantization and
  // EXT_meshopt_compression; DATA_LOSS when the bytes end early.
  static absl::StatusOr<GlbDocument> Read(ByteSource* source);

  const Json& root() const { return json_; }
  uint64_t binary_bytes() const { return binary_.size(); }

  // The object `index` of the list `name` of the root, such as "nodes".
  absl::StatusOr<const Json*> Item(const char* name, uint64_t index) const;

  // INVALID_ARGUMENT when the accessor is sparse, without bytes, in another file, or beyond the
  // bytes of this one; the errors of UnpackRows().
  absl::StatusOr<GlbRows> Rows(uint64_t accessor) const;

  // A member of an object: nullptr where there is none.
  static const Json* Find(const Json& object, const char* name);
  // A member that is a whole number, `otherwise` where there is none.
  static absl::StatusOr<uint64_t> Whole(const Json& object, const char* name, uint64_t otherwise);
  // The same of a member that must be there.
  static absl::StatusOr<uint64_t> Whole(const Json& object, const char* name);
  // A member that is a list, an empty one where there is none.
  static absl::StatusOr<const Json*> List(const Json& object, const char* name);

 private:
  GlbDocument(Json json, std::string_view binary) : json_(std::move(json)), binary_(binary) {}

  absl::StatusOr<GlbRows> RowsOf(const Json& accessor) const;
  // Of bufferViews[index].
  absl::StatusOr<std::string_view> BytesOf(uint64_t index) const;
  absl::StatusOr<std::string_view> StoredBytes(const Json& range) const;
  absl::StatusOr<std::string> UnpackedBytes(const Json& compression) const;

  Json json_;
  std::string_view binary_;
  mutable std::map<uint64_t, std::string> unpacked_;  // by bufferView, once it was asked for
  mutable uint64_t packed_bytes_ = 0;                 // that these came of
};

}  // namespace rilievo
