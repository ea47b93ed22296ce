// rilievo_stress: faults and overload for a real rilievod over real sockets, and a table of what
// was seen.
#include <cstdio>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "CLI/CLI.hpp"
#include "proto/keep_grpc_running.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/parts.h"

namespace rilievo::stress {
namespace {

struct Part {
  std::string name;
  std::function<void(const Scale&, Report*)> run;
  bool in_short_form = true;
};

const std::vector<Part>& Parts() {
  static const std::vector<Part> parts = {
      {"clients", ManyClients},       {"kills", Kills},   {"repeats", Repeats},
      {"readers", SlowReaders},       {"bombs", Bombs},   {"http2", HostileHttp2},
      {"exhaustion", Exhaustion},     {"faults", Faults}, {"cost", ServingCost, false},
      {"options", OddOptions, false},
  };
  return parts;
}

constexpr char kHalfOpen[] = "half-open";

struct CommandLine {
  int seconds = 300, option_seconds = 300;
  uint64_t seed = 1, first_case = 0;
  bool brief = false, json = false;
  std::vector<std::string> only, without;

  // `by_itself`: also when no part is named.
  bool Wants(const std::string& part, bool by_itself) const {
    const auto names = [&](const std::vector<std::string>& parts) {
      return std::find(parts.begin(), parts.end(), part) != parts.end();
    };
    return only.empty() ? by_itself && !names(without) : names(only);
  }
};

int Run(const CommandLine& line) {
  PrepareToConnect();
  Scale scale;
  scale.client_time = std::chrono::seconds(line.seconds);
  if (line.brief) {
    scale = {std::chrono::seconds(8), 8, 10, 1, std::chrono::seconds(2)};
    scale.faults = 4;
    scale.odd_clients = 1;
  }
  scale.options_time = std::chrono::seconds(line.option_seconds);
  scale.seed = line.seed;
  scale.first_case = line.first_case;
  Report report;
  KnownScans();
  {
    // It waits for half a minute and does nothing: beside the others.
    std::jthread beside;
    if (line.Wants(kHalfOpen, true)) beside = std::jthread([&] { HalfOpenPeers(scale, &report); });
    for (const Part& part : Parts()) {
      if (line.Wants(part.name, part.in_short_form || !line.brief)) part.run(scale, &report);
    }
  }
  std::printf("%s\n", (line.json ? report.Json() : report.Table()).c_str());
  return report.Passed() ? 0 : 1;
}

int Main(int argc, char** argv) {
  CommandLine line;
  CLI::App app{"Stresses a real rilievod and reports what was seen."};
  std::vector<std::string> names = {kHalfOpen};
  for (const Part& part : Parts()) names.push_back(part.name);
  app.add_option("--seconds", line.seconds, "the many clients take")
      ->check(CLI::Range(3, 86'400))
      ->capture_default_str();
  app.add_option("--option-seconds", line.option_seconds, "the odd options take")
      ->check(CLI::Range(0, 86'400))
      ->capture_default_str();
  app.add_option("--seed", line.seed, "of the odd options")->capture_default_str();
  app.add_option("--first-case", line.first_case,
                 "of them; with --option-seconds 0 it is worked on again")
      ->capture_default_str();
  app.add_flag("--short", line.brief, "at most 90 s in all, without the cost of serving");
  const auto parts = [&](const char* name, std::vector<std::string>* of, const char* help) {
    return app.add_option(name, *of, help)->check(CLI::IsMember(names))->delimiter(',');
  };
  parts("--without", &line.without, "all parts but these")
      ->excludes(parts("--only", &line.only, "these parts"));
  app.add_flag("--json", line.json, "print JSON instead of a table");
  CLI11_PARSE(app, argc, argv);
  return Run(line);
}

}  // namespace
}  // namespace rilievo::stress

int main(int argc, char** argv) { return rilievo::stress::Main(argc, argv); }
