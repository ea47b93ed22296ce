// The parts of the program: each puts one kind of stress on the server, and reports.
#pragma once

#include <chrono>
#include <cstdint>

#include "tests/stress/report.h"

namespace rilievo::stress {

// How much of everything. The defaults are those of the full form.
struct Scale {
  std::chrono::seconds client_time{300};
  int kills = 100;  // of the server, and again of a worker
  int cuts = 50;    // of an upload
  int cost_pairs = 9;
  std::chrono::seconds flood_time{10};  // of hostile frames
  std::chrono::seconds options_time{300};
  int odd_clients = 2;                // that send odd requests at the same time
  uint64_t seed = 1, first_case = 0;  // of the odd requests
  int faults = 1'000'000;             // of each kind, spread over all that there are
};

// 64 clients, a third of them cancelling or cutting the line.
void ManyClients(const Scale& scale, Report* report);

// kill -9 of the server and of workers.
void Kills(const Scale& scale, Report* report);

// Uploads that are cut, and a request that comes sixteen times at once.
void Repeats(const Scale& scale, Report* report);

// Readers that stop reading.
void SlowReaders(const Scale& scale, Report* report);

// Peers that vanish without a word. Waits for half a minute.
void HalfOpenPeers(const Scale& scale, Report* report);

// Small things that ask for much memory.
void Bombs(const Scale& scale, Report* report);

// Frames of HTTP/2 that no client sends; to the server, and to the front before it.
void HostileHttp2(const Scale& scale, Report* report);

// Options and clouds that nobody would send.
void OddOptions(const Scale& scale, Report* report);

// No disk, no files, no memory.
void Exhaustion(const Scale& scale, Report* report);

// The n-th write, sync, rename or allocation of the server fails, for every n.
void Faults(const Scale& scale, Report* report);

// What a server costs over the library call.
void ServingCost(const Scale& scale, Report* report);

}  // namespace rilievo::stress
