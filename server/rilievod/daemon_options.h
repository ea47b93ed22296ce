// The command line of rilievod.
#pragma once

#include <string>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "server/conversion/server_options.h"

namespace rilievo {

// As it is given; some of `options` are complete only after CompleteOptions().
struct CommandLine {
  ServerOptions options;
  double keep_days = 7;
  double max_job_seconds = 600, max_idle_seconds = 60, drain_seconds = 30;
  std::string worker;
  bool in_process = false;
  std::string probe, probe_service;
  std::string make_token, token_out;
  bool check_store = false, repair = false;
  bool work_only = false;
  double until_idle_seconds = -1;  // below 0: for ever
  std::string backup;
  std::string metrics, channelz;
  std::string log = "json", reflection = "auto";
  double keepalive_seconds = 20, keepalive_timeout_seconds = 10;
};

// Adds every option to `app`, which fills `line` in as it parses.
void DeclareOptions(CommandLine* line, CLI::App* app);

// Times, reflection and memory of `line->options`, once it is parsed. INVALID_ARGUMENT for a time
// that is not finite, and for a store that cannot be used so.
absl::Status CompleteOptions(CommandLine* line);

}  // namespace rilievo
