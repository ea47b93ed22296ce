// A surface's facts as JSON, written here so that the library needs no other one for it.
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/decoder_c/surface.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo::decoder_c {
namespace {

std::string Number(double value) {
  if (!std::isfinite(value)) return "null";
  char text[40];
  for (int digits : {15, 16, 17}) {  // the first that reads back the same
    std::snprintf(text, sizeof(text), "%.*g", digits, value);
    if (std::strtod(text, nullptr) == value) break;
  }
  std::string number = text;
  for (char& c : number) {
    if (c == ',') c = '.';  // a locale of the program around
  }
  return number;
}

// -1 stands for unknown in the header.
std::string Known(double value) { return value < 0 ? "null" : Number(value); }

// Bytes that are no UTF-8 become '?': a file may hold anything.
std::string Text(std::string_view bytes) {
  std::string json = "\"";
  for (size_t i = 0; i < bytes.size();) {
    const auto byte = static_cast<unsigned char>(bytes[i]);
    if (byte < 0x80) {
      if (byte == '"' || byte == '\\') json += '\\';
      if (byte < 0x20) {
        absl::StrAppend(&json, "\\u", absl::Hex(byte, absl::kZeroPad4));
      } else {
        json += bytes[i];
      }
      ++i;
      continue;
    }
    const size_t length = byte >= 0xf0 ? 4 : byte >= 0xe0 ? 3 : 2;
    bool whole = byte >= 0xc2 && byte < 0xf5 && i + length <= bytes.size();
    for (size_t k = 1; whole && k < length; ++k) {
      whole = (static_cast<unsigned char>(bytes[i + k]) & 0xc0) == 0x80;
    }
    if (whole && length > 2) {  // overlong forms, surrogates, beyond U+10FFFF
      const auto second = static_cast<unsigned char>(bytes[i + 1]);
      whole = !(byte == 0xe0 && second < 0xa0) && !(byte == 0xed && second > 0x9f) &&
              !(byte == 0xf0 && second < 0x90) && !(byte == 0xf4 && second > 0x8f);
    }
    json += whole ? bytes.substr(i, length) : std::string_view("?");
    i += whole ? length : 1;
  }
  return json + '"';
}

std::string Distance(const DssDistance& distance) {
  return absl::StrCat("{\"rms\":", Known(distance.rms), ",\"mean\":", Known(distance.mean),
                      ",\"p95\":", Known(distance.p95), ",\"max\":", Known(distance.max), "}");
}

std::string Certificate(const DssMetadata& metadata) {
  return absl::StrCat(
      "{\"error_rms\":", Known(metadata.error_rms), ",\"error_mean\":", Known(metadata.error_mean),
      ",\"error_p95\":", Known(metadata.error_p95), ",\"error_max\":", Known(metadata.error_max),
      ",\"error_across\":", Known(metadata.error_across),
      ",\"surface_to_scan\":", Distance(metadata.surface_to_scan),
      ",\"scan_to_surface\":", Distance(metadata.scan_to_surface),
      ",\"measured_share\":", Known(metadata.measured_share),
      ",\"smoothed_share\":", Known(metadata.smoothed_share),
      ",\"filled_share\":", Known(metadata.filled_share),
      ",\"folds\":", metadata.folds < 0 ? "null" : absl::StrCat(metadata.folds), "}");
}

std::string Levels(const DecodedSurface& decoded, const MeshTopology& control) {
  std::vector<std::string> levels;
  // A step of Loop's scheme turns each edge into a vertex and each face into four.
  int64_t v = control.vertex_count, e = control.edge_count(), f = control.face_count();
  for (int level = 0; level <= decoded.surface.max_level; ++level) {
    levels.push_back(
        absl::StrCat("{\"level\":", level, ",\"vertices\":", v, ",\"faces\":", f, "}"));
    v += e;
    e = 2 * e + 3 * f;
    f *= 4;
  }
  return absl::StrCat("[", absl::StrJoin(levels, ","), "]");
}

}  // namespace

std::string PlaceJson(const ScanPlace& place) {
  // By UpDirection.
  constexpr const char* kUp[] = {"null", "\"x\"", "\"y\"", "\"z\"", "\"-x\"", "\"-y\"", "\"-z\""};
  return absl::StrCat(
      "{\"metres_per_unit\":", place.metres_per_unit > 0 ? Number(place.metres_per_unit) : "null",
      ",\"up\":", kUp[static_cast<size_t>(place.up)],
      ",\"crs\":", place.crs.empty() ? "null" : Text(place.crs), "}");
}

std::string InfoJson(const DecodedSurface& decoded) {
  const DssMetadata& metadata = decoded.metadata;
  const ControlMesh& control = decoded.surface.control_mesh;
  const SpatialFrame& frame = decoded.surface.frame;
  // A decoded control mesh is a manifold.
  const MeshTopology topology =
      *BuildMeshTopology(control.faces, static_cast<int>(control.vertices.cols()));
  const bool closed = topology.face_neighbors.minCoeff() >= 0;
  return absl::StrCat(
      "{\"format_version\":", decoded.format_version, ",\"frame\":{\"center\":[",
      Number(frame.center.x()), ",", Number(frame.center.y()), ",", Number(frame.center.z()),
      "],\"diagonal\":", Number(frame.diagonal), "},\"max_level\":", decoded.surface.max_level,
      ",\"declared_max_level\":", decoded.declared_max_level,
      ",\"levels\":", Levels(decoded, topology), ",\"chunk_bytes\":[",
      absl::StrJoin(decoded.chunk_bytes, ","),
      "],\"control\":{\"vertices\":", control.vertices.cols(), ",\"faces\":", control.faces.cols(),
      ",\"closed\":", closed ? "true" : "false", ",\"creases\":", control.creases.size(),
      ",\"corners\":", control.corners.size(), ",\"scheme\":\"",
      control.quads() ? "catmull-clark" : "loop", "\"},\"certificate\":", Certificate(metadata),
      ",\"place\":", PlaceJson(metadata.place),
      ",\"metadata\":{\"generator\":", Text(metadata.generator),
      ",\"road\":", Text(metadata.topology), ",\"scan_points\":", metadata.scan_points,
      ",\"input_hash\":", Text(absl::BytesToHexString(metadata.input_hash)),
      ",\"options\":", Text(metadata.options), "}}");
}

}  // namespace rilievo::decoder_c
