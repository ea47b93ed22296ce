#include <nlohmann/json.hpp>

#include "client/cli/scan_diagnosis.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;

Json QuantilesJson(const Quantiles& q) {
  return {{"p05", q[0]}, {"p25", q[1]}, {"p50", q[2]}, {"p75", q[3]}, {"p95", q[4]}};
}

}  // namespace

std::string DiagnosisJson(const ScanDiagnosis& d, const std::string& scan,
                          const std::string& format) {
  Json json;
  json["scan"] = scan;
  json["scan_format"] = format;
  json["points_in"] = d.points_in;
  json["non_finite"] = d.non_finite;
  json["duplicates"] = d.duplicates;
  json["strays"] = d.strays;
  json["outliers"] = d.outliers;
  json["island_points"] = d.island_points;
  json["foliage_points"] = d.foliage_points;
  json["points_used"] = d.points_used;
  json["diagonal"] = d.diagonal;
  json["size"] = d.size;
  json["spacing"] = QuantilesJson(d.spacing);
  json["density"] = QuantilesJson(d.density);
  json["noise"] = QuantilesJson(d.noise);
  json["stations"] = d.stations;
  json["stations_used"] = d.stations_used;
  json["setting"] = SettingName(d.setting);
  json["normal_disagreement"] = d.normal_disagreement;
  json["contested"] = d.contested;
  json["point_components"] = d.point_components;
  json["road"] = d.road;
  json["road_reason"] = d.road_reason;
  json["components"] = d.components;
  json["genus"] = d.genus;
  json["control_faces"] = d.control_faces;
  json["loop_lengths"] = d.loop_lengths;
  json["expected_seconds"] = d.expected_seconds;
  json["expected_bytes"] = {d.expected_bytes_low, d.expected_bytes_high};
  json["expected_memory"] = d.expected_memory;
  json["advice"] = d.advice;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace rilievo
