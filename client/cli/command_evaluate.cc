#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/vector_json.h"
#include "client/formats/block_writer.h"
#include "client/formats/number_text.h"
#include "core/base/status_macros.h"
#include "core/evaluate/closest_point_finder.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

struct EvaluateArguments {
  std::string input, points;
  std::vector<std::string> at;
  ScanArguments scan;
  bool smooth = false, json = false;
};

struct Parameter {
  int64_t face = 0;
  double u = 0, v = 0;
};

absl::StatusOr<Parameter> ReadParameter(const std::string& word) {
  const std::vector<std::string> parts = absl::StrSplit(word, ',');
  Parameter at;
  if (parts.size() == 3 && absl::SimpleAtoi(parts[0], &at.face) &&
      absl::SimpleAtod(parts[1], &at.u) && absl::SimpleAtod(parts[2], &at.v)) {
    return at;
  }
  return UsageError(absl::StrCat("--at ", word,
                                 ": must be a control face and its parameters u and v, with commas "
                                 "between them (17,0.25,0.5)"));
}

std::string Words(const Vector3d& vector) {
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0) text += ' ';
    AppendNumber(vector[axis], &text);
  }
  return text;
}

// A number that does not exist is null in JSON.
Json JetJson(const Parameter& at, const SurfaceJet& jet, const SurfaceShape& shape) {
  return {{"face", at.face},
          {"u", at.u},
          {"v", at.v},
          {"position", VectorJson(jet.position)},
          {"normal", VectorJson(shape.normal)},
          {"du", VectorJson(jet.u)},
          {"dv", VectorJson(jet.v)},
          {"duu", VectorJson(jet.uu)},
          {"duv", VectorJson(jet.uv)},
          {"dvv", VectorJson(jet.vv)},
          {"least_curvature", shape.least_curvature},
          {"greatest_curvature", shape.greatest_curvature},
          {"irregular_vertex", jet.irregular}};
}

void PrintJet(const std::string& word, const SurfaceJet& jet, const SurfaceShape& shape) {
  std::cout << word << '\n'
            << LabelledLine("position", Words(jet.position))
            << LabelledLine("normal", Words(shape.normal)) << LabelledLine("du", Words(jet.u))
            << LabelledLine("dv", Words(jet.v));
  if (jet.irregular) {
    std::cout << LabelledLine("note",
                              "an irregular vertex: du and dv span the tangent plane, and there "
                              "are no second derivatives and no curvatures");
    return;
  }
  std::cout << LabelledLine("duu", Words(jet.uu)) << LabelledLine("duv", Words(jet.uv))
            << LabelledLine("dvv", Words(jet.vv));
  std::string curvatures;
  AppendNumber(shape.least_curvature, &curvatures);
  curvatures += ' ';
  AppendNumber(shape.greatest_curvature, &curvatures);
  std::cout << LabelledLine("curvatures", curvatures);
}

absl::Status EvaluateAt(const DisplacedSurface& surface, const EvaluateArguments& arguments,
                        const std::vector<Parameter>& parameters, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const DisplacedEvaluator evaluator,
                           DisplacedEvaluator::Build(surface, context));
  Json places = Json::array();
  for (size_t i = 0; i < parameters.size(); ++i) {
    const absl::Status fits = evaluator.Check(parameters[i].face, parameters[i].u, parameters[i].v);
    if (!fits.ok()) return AtPath(absl::StrCat("--at ", arguments.at[i]), fits);
  }
  for (size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& at = parameters[i];
    const SurfaceJet jet = evaluator.At(static_cast<int>(at.face), at.u, at.v, JetOrder::kSecond);
    if (arguments.json) {
      places.push_back(JetJson(at, jet, ShapeOf(jet)));
    } else {
      PrintJet(arguments.at[i], jet, ShapeOf(jet));
    }
  }
  if (arguments.json) std::cout << Json{{"at", places}}.dump(2) << '\n';
  return absl::OkStatus();
}

// One line for each point; millions of them never become a tree of JSON values.
void WriteClosest(const std::vector<ClosestPoint>& points, bool json) {
  BlockWriter writer(std::cout);
  writer.text() += json ? "{\n  \"closest\": [" : "# x y z distance face u v\n";
  const auto add = [&](const char* before, double value) {
    writer.text() += before;
    AppendNumber(value, &writer.text());
  };
  for (size_t i = 0; i < points.size(); ++i) {
    const ClosestPoint& point = points[i];
    if (json) writer.text() += i == 0 ? "\n    {" : ",\n    {";
    add(json ? "\"position\": [" : "", point.position.x());
    add(json ? ", " : " ", point.position.y());
    add(json ? ", " : " ", point.position.z());
    add(json ? "], \"distance\": " : " ", point.distance);
    writer.text() += json ? ", \"face\": " : " ";
    AppendNumber(int64_t{point.face}, &writer.text());
    add(json ? ", \"u\": " : " ", point.u);
    add(json ? ", \"v\": " : " ", point.v);
    writer.text() += json ? "}" : "\n";
  }
  if (json) writer.text() += "\n  ]\n}\n";
}

absl::Status FindClosest(const DisplacedSurface& surface, const EvaluateArguments& arguments,
                         const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan, LoadScan(arguments.points, arguments.scan));
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointFinder finder,
                           ClosestPointFinder::Build(surface, context));
  const auto found = finder.Find(scan.cloud.points, context);
  if (!found.ok()) return AtPath(arguments.points, found.status());
  WriteClosest(*found, arguments.json);
  return absl::OkStatus();
}

absl::Status Evaluate(const EvaluateArguments& arguments, std::stop_token stop) {
  if (arguments.at.empty() && arguments.points.empty()) {
    return UsageError("where to evaluate is missing; give --at or --points");
  }
  std::vector<Parameter> parameters;
  for (const std::string& word : arguments.at) {
    RILIEVO_ASSIGN_OR_RETURN(const Parameter at, ReadParameter(word));
    parameters.push_back(at);
  }
  RILIEVO_RETURN_IF_ERROR(
      CheckFiles({.inputs = {arguments.input, arguments.points}, .text = {"-"}}));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(DecodedSurface decoded, LoadDss(arguments.input, context));
  DisplacedSurface& surface = decoded.surface;
  if (arguments.smooth) std::fill(surface.heights.begin(), surface.heights.end(), 0.f);
  return parameters.empty() ? FindClosest(surface, arguments, context)
                            : EvaluateAt(surface, arguments, parameters, context);
}

}  // namespace

Command AddEvaluate(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "evaluate", "Tell positions, derivatives and curvatures, or closest points");
  const auto arguments = std::make_shared<EvaluateArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  CLI::Option* at =
      app->add_option("--at", arguments->at,
                      "a control face, counted from 0, and its parameters: u weighs its second "
                      "corner, v its third; several may follow")
          ->type_name("F,U,V");
  app->add_option("--points", arguments->points,
                  "a scan: for each of its points, in their order, the closest point of the "
                  "surface, its distance, and its control face with u and v")
      ->excludes(at);
  AddScanOptions(app, &arguments->scan);
  app->add_flag("--smooth", arguments->smooth, "of the smooth surface, without the heights");
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Evaluate(*arguments, stop); }};
}

}  // namespace rilievo
