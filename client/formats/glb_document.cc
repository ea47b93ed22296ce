#include "client/formats/glb_document.h"

#include <algorithm>
#include <array>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/meshopt/unpack_rows.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Json = nlohmann::json;

constexpr uint32_t kGlbMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr uint64_t kMostJsonBytes = uint64_t{16} << 20;
// A value takes up to a hundred bytes of memory and two of the file.
constexpr uint64_t kMostJsonValues = 1'000'000;
constexpr char kMeshopt[] = "EXT_meshopt_compression";

template <typename... Words>
absl::Status GlbError(const Words&... words) {
  return absl::InvalidArgumentError(absl::StrCat(words...));
}

bool StartsWithWord(std::string_view text, std::string_view prefix) {
  return text.substr(0, prefix.size()) == prefix;
}

// What no mesh is made of.
bool IsPassedOver(int depth, const std::string& key) {
  if (key == "extras" || key == "name") return true;
  if (depth > 1) return false;
  for (const char* used : {"scene", "scenes", "nodes", "meshes", "accessors", "bufferViews",
                           "buffers", "extensionsRequired"}) {
    if (key == used) return false;
  }
  return true;
}

absl::StatusOr<Json> ParseJson(std::string_view text) {
  uint64_t values = 0;
  const auto keep = [&](int depth, Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::key) {
      return !IsPassedOver(depth, parsed.get_ref<const std::string&>());
    }
    return ++values <= kMostJsonValues;
  };
  Json json = Json::parse(text.begin(), text.end(), keep, /*allow_exceptions=*/false);
  if (values > kMostJsonValues) {
    return GlbError("the JSON has more than ", kMostJsonValues, " values; join its meshes");
  }
  if (!json.is_object()) return GlbError("the first chunk is not a JSON object");
  return json;
}

// Extensions that leave the triangles as they are may be required.
absl::Status CheckExtensions(const Json& root) {
  RILIEVO_ASSIGN_OR_RETURN(const Json* required, GlbDocument::List(root, "extensionsRequired"));
  for (const Json& entry : *required) {
    if (!entry.is_string()) return GlbError("'extensionsRequired' holds what is not a name");
    const std::string& name = entry.get_ref<const std::string&>();
    bool harmless = false;
    for (const char* prefix : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_",
                               "KHR_mesh_quantization", kMeshopt}) {
      harmless |= StartsWithWord(name, prefix);
    }
    if (harmless) continue;
    const char* remedy = "export the mesh without it";
    if (name == "KHR_draco_mesh_compression") remedy = "export the mesh without Draco compression";
    if (name == "KHR_meshopt_compression") {
      remedy = "export the mesh with EXT_meshopt_compression, or without compression";
    }
    return GlbError("the file requires the extension ", name, ", which is not read; ", remedy);
  }
  return absl::OkStatus();
}

// The bytes of the next chunk, of this type.
absl::StatusOr<std::string_view> TakeChunk(ByteSource* source, uint64_t length, const char* what) {
  const char* bytes = source->Take(length);
  if (bytes == nullptr) {
    return absl::DataLossError(absl::StrCat("the chunk ", what, " claims ", length,
                                            " bytes, more than are left; truncated file?"));
  }
  return std::string_view(bytes, length);
}

struct ChunkHead {
  uint64_t length = 0;
  uint32_t type = 0;
};

absl::StatusOr<ChunkHead> TakeChunkHead(ByteSource* source) {
  const char* head = source->Take(8);
  if (head == nullptr) return absl::DataLossError("ends in the header of a chunk");
  return ChunkHead{LoadAs<uint32_t>(head, kSwapLittle), LoadAs<uint32_t>(head + 4, kSwapLittle)};
}

// How many bytes the file has by its header, without that.
absl::StatusOr<uint64_t> TakeGlbHeader(ByteSource* source) {
  const char* head = source->Take(12);
  if (head == nullptr) return absl::DataLossError("shorter than its 12-byte header");
  if (LoadAs<uint32_t>(head, kSwapLittle) != kGlbMagic) {
    return GlbError("the first bytes are not 'glTF'");
  }
  const auto version = LoadAs<uint32_t>(head + 4, kSwapLittle);
  if (version != 2) return GlbError("version ", version, " is not read; convert it to glTF 2.0");
  const uint64_t length = LoadAs<uint32_t>(head + 8, kSwapLittle);
  if (length < 20) return GlbError("the header says that the file has ", length, " bytes");
  return length - 12;
}

absl::StatusOr<ScalarType> ComponentType(uint64_t number) {
  switch (number) {
    case 5120:
      return ScalarType::kI8;
    case 5121:
      return ScalarType::kU8;
    case 5122:
      return ScalarType::kI16;
    case 5123:
      return ScalarType::kU16;
    case 5125:
      return ScalarType::kU32;
    case 5126:
      return ScalarType::kF32;
    default:
      return GlbError("'componentType' is ", number);
  }
}

absl::StatusOr<size_t> WidthOf(const Json& accessor) {
  constexpr std::array<const char*, 4> kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  const Json* type = GlbDocument::Find(accessor, "type");
  for (size_t i = 0; type != nullptr && i < kTypes.size(); ++i) {
    if (*type == kTypes[i]) return i + 1;
  }
  return GlbError("'type' must be SCALAR, VEC2, VEC3 or VEC4");
}

}  // namespace

double GlbRows::Value(uint64_t row, size_t column) const {
  return LoadScalar(bytes + row * stride + column * ScalarSize(type), type, kSwapLittle);
}

double GlbRows::Real(uint64_t row, size_t column) const {
  const double value = Value(row, column);
  if (!normalized) return value;
  switch (type) {  // glTF 2.0, section 3.6.2.2
    case ScalarType::kI8:
      return std::max(value / 127, -1.0);
    case ScalarType::kU8:
      return value / 255;
    case ScalarType::kI16:
      return std::max(value / 32767, -1.0);
    case ScalarType::kU16:
      return value / 65535;
    default:
      return value;
  }
}

absl::StatusOr<GlbDocument> GlbDocument::Read(ByteSource* source) {
  RILIEVO_ASSIGN_OR_RETURN(uint64_t left, TakeGlbHeader(source));
  const auto next = [&]() -> absl::StatusOr<ChunkHead> {
    RILIEVO_ASSIGN_OR_RETURN(const ChunkHead head, TakeChunkHead(source));
    left -= 8;
    if (head.length > left) {
      return GlbError("a chunk claims ", head.length, " bytes, but the header leaves ", left);
    }
    left -= head.length;
    return head;
  };
  RILIEVO_ASSIGN_OR_RETURN(const ChunkHead first, next());
  if (first.type != kJsonChunk) return GlbError("the first chunk is not JSON");
  if (first.length > kMostJsonBytes) {
    return GlbError("the JSON has ", first.length, " bytes, more than 16 MiB");
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::string_view text, TakeChunk(source, first.length, "JSON"));
  RILIEVO_ASSIGN_OR_RETURN(Json json, ParseJson(text));
  RILIEVO_RETURN_IF_ERROR(CheckExtensions(json));
  std::string_view binary;
  if (left >= 8) {
    RILIEVO_ASSIGN_OR_RETURN(const ChunkHead second, next());
    if (second.type == kBinaryChunk) {
      RILIEVO_ASSIGN_OR_RETURN(binary, TakeChunk(source, second.length, "BIN"));
    }
  }
  return GlbDocument(std::move(json), binary);
}

const Json* GlbDocument::Find(const Json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

absl::StatusOr<uint64_t> GlbDocument::Whole(const Json& object, const char* name,
                                            uint64_t otherwise) {
  const Json* value = Find(object, name);
  if (value == nullptr) return otherwise;
  if (!value->is_number_unsigned()) {
    return GlbError("'", name, "' must be a whole number, at least 0");
  }
  return value->get<uint64_t>();
}

absl::StatusOr<uint64_t> GlbDocument::Whole(const Json& object, const char* name) {
  if (Find(object, name) != nullptr) return Whole(object, name, 0);
  return GlbError("'", name, "' is missing");
}

absl::StatusOr<const Json*> GlbDocument::List(const Json& object, const char* name) {
  static const Json* const empty = new Json(Json::array());
  const Json* list = Find(object, name);
  if (list == nullptr) return empty;
  if (!list->is_array()) {
    return GlbError("'", name, "' must be a list");
  }
  return list;
}

absl::StatusOr<const Json*> GlbDocument::Item(const char* name, uint64_t index) const {
  const Json* list = Find(json_, name);
  const size_t count = list != nullptr && list->is_array() ? list->size() : 0;
  if (index >= count) return GlbError("there is no ", name, "[", index, "], but ", count);
  const Json& item = (*list)[index];
  if (!item.is_object()) return GlbError(name, "[", index, "] must be an object");
  return &item;
}

absl::StatusOr<GlbRows> GlbDocument::Rows(uint64_t accessor) const {
  RILIEVO_ASSIGN_OR_RETURN(const Json* item, Item("accessors", accessor));
  absl::StatusOr<GlbRows> rows = RowsOf(*item);
  if (rows.ok()) return rows;
  return GlbError("accessors[", accessor, "]: ", rows.status().message());
}

absl::StatusOr<GlbRows> GlbDocument::RowsOf(const Json& accessor) const {
  if (Find(accessor, "sparse") != nullptr) {
    return GlbError("sparse, which is not read; export it with all its values");
  }
  GlbRows rows;
  RILIEVO_ASSIGN_OR_RETURN(rows.count, Whole(accessor, "count"));
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t component, Whole(accessor, "componentType"));
  RILIEVO_ASSIGN_OR_RETURN(rows.type, ComponentType(component));
  RILIEVO_ASSIGN_OR_RETURN(rows.width, WidthOf(accessor));
  const Json* normalized = Find(accessor, "normalized");
  rows.normalized = normalized != nullptr && *normalized == true;
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t view_index, Whole(accessor, "bufferView"));
  RILIEVO_ASSIGN_OR_RETURN(const Json* view, Item("bufferViews", view_index));
  RILIEVO_ASSIGN_OR_RETURN(const std::string_view bytes, BytesOf(view_index));
  const size_t row_bytes = rows.width * ScalarSize(rows.type);
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t stride, Whole(*view, "byteStride", row_bytes));
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t offset, Whole(accessor, "byteOffset", 0));
  if (rows.count == 0) return GlbError("'count' is 0");
  if (stride < row_bytes) {
    return GlbError("bufferViews[", view_index, "]: 'byteStride' is ", stride, " for rows of ",
                    row_bytes, " bytes");
  }
  if (offset > bytes.size() || row_bytes > bytes.size() - offset ||
      rows.count - 1 > (bytes.size() - offset - row_bytes) / stride) {
    return GlbError("'count' is ", rows.count, " from byte ", offset, ", more than the ",
                    bytes.size(), " bytes of bufferViews[", view_index, "] hold");
  }
  rows.stride = stride;
  rows.bytes = bytes.data() + offset;
  return rows;
}

absl::StatusOr<std::string_view> GlbDocument::BytesOf(uint64_t index) const {
  RILIEVO_ASSIGN_OR_RETURN(const Json* view, Item("bufferViews", index));
  const Json* extensions = Find(*view, "extensions");
  const Json* compression = extensions != nullptr ? Find(*extensions, kMeshopt) : nullptr;
  if (compression == nullptr) return StoredBytes(*view);
  const auto known = unpacked_.find(index);
  if (known != unpacked_.end()) return known->second;
  absl::StatusOr<std::string> bytes = UnpackedBytes(*compression);
  if (!bytes.ok()) {
    return absl::Status(bytes.status().code(),
                        absl::StrCat("bufferViews[", index, "]: ", bytes.status().message()));
  }
  return unpacked_.emplace(index, *std::move(bytes)).first->second;
}

absl::StatusOr<std::string> GlbDocument::UnpackedBytes(const Json& compression) const {
  PackedRows packed;
  RILIEVO_ASSIGN_OR_RETURN(packed.bytes, StoredBytes(compression));
  // Each byte is unpacked once, so that a small file stays small.
  packed_bytes_ += packed.bytes.size();
  if (packed_bytes_ > binary_.size()) {
    return absl::InvalidArgumentError(absl::StrCat("the compressed bufferViews so far name ",
                                                   packed_bytes_, " bytes of a binary chunk of ",
                                                   binary_.size(), "; they must not overlap"));
  }
  RILIEVO_ASSIGN_OR_RETURN(packed.rows, Whole(compression, "count"));
  RILIEVO_ASSIGN_OR_RETURN(packed.stride, Whole(compression, "byteStride"));
  for (const auto& [name, word] :
       {std::pair("mode", &packed.mode), std::pair("filter", &packed.filter)}) {
    const Json* member = Find(compression, name);
    if (member != nullptr && member->is_string()) *word = member->get<std::string>();
  }
  return UnpackRows(packed);
}

// `range`: an object with 'buffer', 'byteOffset' and 'byteLength'.
absl::StatusOr<std::string_view> GlbDocument::StoredBytes(const Json& range) const {
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t buffer, Whole(range, "buffer"));
  RILIEVO_ASSIGN_OR_RETURN(const Json* item, Item("buffers", buffer));
  if (buffer != 0 || Find(*item, "uri") != nullptr) {
    return GlbError("buffers[", buffer, "] is not within the file; pack all into one .glb");
  }
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t offset, Whole(range, "byteOffset", 0));
  RILIEVO_ASSIGN_OR_RETURN(const uint64_t length, Whole(range, "byteLength"));
  if (offset > binary_.size() || length > binary_.size() - offset) {
    return GlbError("its bufferView has ", length, " bytes from ", offset,
                    ", the file's chunk BIN has ", binary_.size());
  }
  return binary_.substr(offset, length);
}

}  // namespace rilievo
