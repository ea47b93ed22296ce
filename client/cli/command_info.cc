#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/length_words.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/place_options.h"
#include "client/cli/scan_error.h"
#include "core/base/status_macros.h"
#include "core/codec/container/open_dss.h"
#include "core/geometry/mesh_topology.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;

struct InfoArguments {
  std::string input;
  bool json = false;
};

struct SurfaceFacts {
  std::vector<int64_t> level_bytes;      // of each level's chunk, 0 where it has none
  int64_t flag_bytes = 0;                // of the chunk that tells smoothed heights
  TopologySummary topology;              // of the control mesh
  std::vector<int64_t> vertices, faces;  // per level
  int64_t measured = 0, smoothed = 0, filled = 0;
  int64_t bytes = 0;
  int64_t update_bytes = 0;  // of these, of the updates
};

SurfaceFacts Facts(const DecodedSurface& decoded, const OpenedDss& file) {
  const DisplacedSurface& surface = decoded.surface;
  SurfaceFacts facts;
  facts.topology = SummarizeTopology(surface.control_mesh.faces,
                                     static_cast<int>(surface.control_mesh.vertices.cols()));
  // A step of refinement turns each edge into a vertex and each face into four.
  int64_t v = facts.topology.vertices, e = facts.topology.edges, f = facts.topology.faces;
  for (int level = 0; level <= surface.max_level; ++level) {
    facts.vertices.push_back(v);
    facts.faces.push_back(f);
    v += e;
    e = 2 * e + 3 * f;
    f *= 4;
  }
  for (HeightSource source : surface.sources) {
    facts.measured += source == HeightSource::kMeasured;
    facts.smoothed += source == HeightSource::kSmoothed;
    facts.filled += source == HeightSource::kFilled;
  }
  const bool whole = surface.max_level == decoded.declared_max_level;
  const size_t layers =
      facts.vertices.size() - (whole ? decoded.metadata.plain_levels.size() : size_t{0});
  const std::vector<int64_t>& chunks = decoded.chunk_bytes;
  for (size_t level = 0; level < facts.vertices.size(); ++level) {
    facts.level_bytes.push_back(level < layers && level + 1 < chunks.size() ? chunks[level + 1]
                                                                            : 0);
  }
  if (chunks.size() > layers + 1) facts.flag_bytes = chunks.back();
  facts.bytes = std::accumulate(chunks.begin(), chunks.end(), int64_t{0});
  // They count to the chunk before them.
  for (const Chunk& chunk : file.updates) facts.update_bytes += chunk.bytes;
  int64_t& before = facts.flag_bytes > 0 ? facts.flag_bytes : facts.level_bytes.back();
  if (facts.update_bytes > 0) before -= facts.update_bytes;
  return facts;
}

ScanError ScanErrorOf(const DecodedSurface& decoded) {
  const DssDistance& error = decoded.metadata.scan_to_surface;
  const double d = decoded.surface.frame.diagonal;
  return {error.rms * d, error.p95 * d, error.max * d, d, decoded.metadata.place};
}

Json InfoJson(const DecodedSurface& decoded, const SurfaceFacts& facts) {
  const DssMetadata& metadata = decoded.metadata;
  Json json;
  json["format_version"] = decoded.format_version;
  json["bytes"] = facts.bytes;
  json["generator"] = metadata.generator;
  json["road"] = metadata.topology;
  json["scan_points"] = metadata.scan_points;
  json["scan_to_surface"] =
      metadata.scan_to_surface.rms < 0 ? Json() : ScanErrorJson(ScanErrorOf(decoded));
  json["error_rms_ratio"] = metadata.error_rms < 0 ? Json() : Json(metadata.error_rms);
  json["error_max_ratio"] = metadata.error_max < 0 ? Json() : Json(metadata.error_max);
  json["error_across_ratio"] = metadata.error_across < 0 ? Json() : Json(metadata.error_across);
  const SpatialFrame& frame = decoded.surface.frame;
  json["frame"] = {{"center", {frame.center.x(), frame.center.y(), frame.center.z()}},
                   {"diagonal", frame.diagonal}};
  const ScanPlace& place = metadata.place;
  json["place"] = {
      {"metres_per_unit", place.metres_per_unit > 0 ? Json(place.metres_per_unit) : Json()},
      {"unit", place.metres_per_unit > 0 ? Json(UnitName(place.metres_per_unit)) : Json()},
      {"up", place.up != UpDirection::kUnknown ? Json(UpName(place.up)) : Json()},
      {"crs", place.crs.empty() ? Json() : Json(place.crs)}};
  json["components"] = facts.topology.components;
  json["genus"] = facts.topology.genus;
  json["boundary_loops"] = facts.topology.boundary_loops;
  json["closed"] = facts.topology.closed();
  json["manifold"] = facts.topology.manifold();
  json["scheme"] = decoded.surface.control_mesh.quads() ? "catmull-clark" : "loop";
  json["max_level"] = decoded.surface.max_level;
  json["heights"] = {
      {"measured", facts.measured}, {"smoothed", facts.smoothed}, {"filled", facts.filled}};
  json["control_bytes"] = decoded.chunk_bytes.empty() ? 0 : decoded.chunk_bytes[0];
  json["levels"] = Json::array();
  for (size_t level = 0; level < facts.vertices.size(); ++level) {
    json["levels"].push_back({{"level", level},
                              {"vertices", facts.vertices[level]},
                              {"faces", facts.faces[level]},
                              {"bytes", facts.level_bytes[level]}});
  }
  json["flag_bytes"] = facts.flag_bytes;
  json["color_bytes"] = decoded.color_bytes;
  json["update_bytes"] = facts.update_bytes;
  return json;
}

// The name of a well-known text, or the short form as it is.
std::string CrsName(const std::string& crs) {
  const size_t begin = crs.find('"'), end = crs.find('"', begin + 1);
  if (begin == std::string::npos || end == std::string::npos) return crs;
  return crs.substr(begin + 1, end - begin - 1);
}

void PrintPlace(const ScanPlace& place) {
  const auto known = [](const std::string& text) { return text.empty() ? "not known" : text; };
  std::cout << LabelledLine("unit", absl::StrCat(known(UnitName(place.metres_per_unit)), ", up ",
                                                 known(UpName(place.up))));
  if (!place.crs.empty()) std::cout << LabelledLine("crs", CrsName(place.crs));
}

void PrintInfo(const std::string& path, const DecodedSurface& decoded, const SurfaceFacts& facts) {
  const DssMetadata& metadata = decoded.metadata;
  const TopologySummary& topology = facts.topology;
  std::cout << path << '\n';
  std::cout << LabelledLine(
      "file",
      absl::StrCat(Counted(facts.bytes, "byte", "bytes"), ", format ", decoded.format_version,
                   ", by ", metadata.generator.empty() ? "?" : metadata.generator));
  std::cout << LabelledLine(
      "surface",
      absl::StrCat(
          Counted(topology.components, "component", "components"), ", genus ", topology.genus, ", ",
          topology.closed() ? std::string("closed")
                            : Counted(topology.boundary_loops, "boundary loop", "boundary loops"),
          decoded.surface.control_mesh.quads() ? ", Catmull-Clark over quads" : ""));
  const SpatialFrame& frame = decoded.surface.frame;
  std::cout << LabelledLine(
      "place", absl::StrCat("diagonal ", Short(frame.diagonal), ", centre (", frame.center.x(),
                            ", ", frame.center.y(), ", ", frame.center.z(), ")"));
  PrintPlace(metadata.place);
  if (metadata.scan_points > 0) {
    const bool is_mesh = InputName(metadata.topology) == std::string("mesh");
    std::cout << LabelledLine(InputName(metadata.topology),
                              is_mesh
                                  ? Counted(metadata.scan_points, "vertex", "vertices")
                                  : absl::StrCat(Counted(metadata.scan_points, "point", "points"),
                                                 ", topology ", metadata.topology));
  }
  if (metadata.scan_to_surface.rms >= 0) {
    std::cout << LabelledLine(
        "error", absl::StrCat(InputName(metadata.topology), " to surface: ",
                              ScanErrorText(ScanErrorOf(decoded)), "; % of the diagonal"));
  }
  const double heights =
      std::max(1.0, static_cast<double>(facts.measured + facts.smoothed + facts.filled));
  std::cout << LabelledLine(
      "heights", absl::StrCat(Percent(static_cast<double>(facts.measured) / heights), " measured, ",
                              Percent(static_cast<double>(facts.smoothed) / heights), " smoothed, ",
                              Percent(static_cast<double>(facts.filled) / heights), " filled in"));
  if (!decoded.chunk_bytes.empty()) {
    std::cout << LabelledLine("control", Counted(decoded.chunk_bytes[0], "byte", "bytes"));
  }
  for (size_t level = 0; level < facts.vertices.size(); ++level) {
    std::cout << LabelledLine(absl::StrCat("level ", level),
                              absl::StrCat(Counted(facts.vertices[level], "vertex", "vertices"),
                                           ", ", Counted(facts.faces[level], "face", "faces"), ", ",
                                           Counted(facts.level_bytes[level], "byte", "bytes")));
  }
  if (decoded.color_bytes > 0) {
    std::cout << LabelledLine(
        "colours", absl::StrCat("one a vertex, ", Counted(decoded.color_bytes, "byte", "bytes"),
                                " of those of the levels"));
  }
  if (facts.flag_bytes > 0) {
    std::cout << LabelledLine("flags", Counted(facts.flag_bytes, "byte", "bytes"));
  }
  if (facts.update_bytes > 0) {
    std::cout << LabelledLine("updates", Counted(facts.update_bytes, "byte", "bytes"));
  }
}

absl::Status Info(const InfoArguments& arguments, std::stop_token stop) {
  RILIEVO_RETURN_IF_ERROR(CheckFiles({.inputs = {arguments.input}, .text = {"-"}}));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded,
                           DecodeBytes(arguments.input, bytes, context));
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(bytes, false));
  const SurfaceFacts facts = Facts(decoded, file);
  if (arguments.json) {
    // A file may hold texts that are no UTF-8.
    std::cout << InfoJson(decoded, facts).dump(2, ' ', false, Json::error_handler_t::replace)
              << '\n';
  } else {
    PrintInfo(arguments.input, decoded, facts);
  }
  return absl::OkStatus();
}

}  // namespace

Command AddInfo(CLI::App& program) {
  CLI::App* app = program.add_subcommand("info", "Describe a surface file");
  const auto arguments = std::make_shared<InfoArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Info(*arguments, stop); }};
}

}  // namespace rilievo
