#include <chrono>
#include <random>

#include "client/library/status_conversion.h"
#include "tests/integration/line.h"
#include "tests/stress/known_scans.h"
#include "tests/stress/ledger.h"
#include "tests/stress/parts.h"
#include "tests/stress/stress_server.h"

namespace rilievo::stress {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr char kClientsPart[] = "clients";
constexpr int kClients = 64;
constexpr int64_t kMostCrowdGrowth = 16'000'000;

struct Tally {
  std::atomic<int> whole = 0;   // calls and jobs whose surface came right
  std::atomic<int> broken = 0;  // cancelled or cut by the client itself
  std::atomic<int> turned = 0;  // told to come back later
  std::atomic<int> wrong = 0;   // other bytes, or an error that nobody asked for
  std::atomic<int> ended_twice = 0;
  std::mutex mutex;
  std::string first_fault;

  void Fault(const std::string& what) {
    ++wrong;
    const std::lock_guard lock(mutex);
    if (first_fault.empty()) first_fault = what;
  }
};

// One of the crowd; every third is rough.
class Client {
 public:
  Client(int number, const StressServer& server, Ledger* ledger, Tally* tally)
      : number_(number),
        server_(server),
        ledger_(ledger),
        tally_(tally),
        random_(static_cast<uint32_t>(number)),
        channel_(OwnConnection(server.address())) {}

  void Run(const std::stop_token& stop) {
    const bool rough = number_ % 3 == 0;
    for (; !stop.stop_requested(); ++round_) {
      scan_ = random_() % KnownScans().size();
      if (random_() % 2 == 0) {
        rough ? BreakCall() : CallOnce();
      } else {
        rough ? BreakJob() : KeepJob();
      }
    }
  }

 private:
  const KnownScan& Scan() const { return KnownScans()[scan_]; }
  milliseconds SomeTime() { return milliseconds(random_() % 1500); }

  void CallOnce() {
    const auto result = ReconstructionClient(channel_).Reconstruct(Scan().cloud, {});
    if (result.ok() && result->dss == Scan().surface) {
      ++tally_->whole;
    } else if (const auto delay = RetryDelay(result.status())) {
      ++tally_->turned;
      std::this_thread::sleep_for(std::min<milliseconds>(*delay, seconds(2)));
    } else {
      tally_->Fault(result.ok() ? "other bytes" : result.status().ToString());
    }
  }

  // Cancelled, or its line cut, at any moment.
  void BreakCall() {
    Line line(server_.port());
    std::stop_source cancel;
    const bool cut = random_() % 2 == 0;
    const milliseconds when = SomeTime();
    std::jthread breaker([&] {
      std::this_thread::sleep_for(when);
      if (cut) {
        line.Cut();
      } else {
        cancel.request_stop();
      }
    });
    CallOptions options;
    options.stop = cancel.get_token();
    const auto result = ReconstructionClient(OwnConnection(line.address()))
                            .Reconstruct(Scan().cloud, {}, {}, options);
    if (result.ok() && result->dss != Scan().surface) tally_->Fault("other bytes");
    ++(result.ok() ? tally_->whole : tally_->broken);
  }

  absl::StatusOr<v1::Job> Submit() {
    auto job = server_.Jobs(channel_).Submit(
        Scan().packed, {}, absl::StrFormat("c%d-%d", number_, round_), {}, Within(seconds(60)));
    if (job.ok()) {
      ledger_->Acknowledged(job->job_id(), scan_);
    } else {
      tally_->Fault(job.status().ToString());
    }
    return job;
  }

  // Watches to the end, which must come once, and fetches.
  void Collect(const std::string& job_id) {
    int ends = 0;
    const JobsClient jobs = server_.Jobs(channel_);
    const auto done = jobs.Watch(
        job_id, [&](const v1::JobEvent& event) { ends += event.job().has_end_time(); },
        Within(seconds(120)));
    tally_->ended_twice += ends > 1;
    const auto surface = jobs.Fetch(job_id, {}, Within(seconds(60)));
    if (surface.ok() && *surface == Scan().surface) {
      ++tally_->whole;
    } else if (!done.ok() || done->state() != v1::JOB_STATE_CANCELLED) {
      tally_->Fault(surface.ok() ? "other bytes" : surface.status().ToString());
    }
  }

  void KeepJob() {
    if (const auto job = Submit(); job.ok()) Collect(job->job_id());
  }

  // Its owner goes away while it watches, and comes back; or cancels it.
  void BreakJob() {
    const auto job = Submit();
    if (!job.ok()) return;
    ++tally_->broken;
    if (random_() % 2 == 0) {
      std::this_thread::sleep_for(SomeTime());
      ledger_->Cancelled(job->job_id());
      const auto cancelled = server_.Jobs(channel_).Cancel(job->job_id(), Within(seconds(60)));
      if (!cancelled.ok()) tally_->Fault(cancelled.status().ToString());
      return;
    }
    {
      Line line(server_.port());
      const milliseconds when = SomeTime();
      std::jthread cutter([&] {
        std::this_thread::sleep_for(when);
        line.Cut();
      });
      const JobsClient once(OwnConnection(line.address()), {.attempts = 1});
      once.Watch(job->job_id(), {}, Within(seconds(60))).status().IgnoreError();
      once.Fetch(job->job_id(), {}, Within(seconds(60))).status().IgnoreError();
    }
    Collect(job->job_id());
  }

  const int number_;
  const StressServer& server_;
  Ledger* const ledger_;
  Tally* const tally_;
  std::mt19937 random_;
  const std::shared_ptr<grpc::Channel> channel_;
  int round_ = 0;
  size_t scan_ = 0;
};

// The most memory that the server had in the second third of the time, and in the last.
struct Memory {
  int64_t middle = 0, last = 0;
};

Memory RunCrowd(const Scale& scale, const StressServer& server, Ledger* ledger, Tally* tally) {
  std::vector<std::jthread> threads;
  for (int i = 0; i < kClients; ++i) {
    threads.emplace_back([&server, ledger, tally, i](const std::stop_token& stop) {
      Client(i, server, ledger, tally).Run(stop);
    });
  }
  Memory memory;
  const auto start = std::chrono::steady_clock::now();
  const double whole = static_cast<double>(scale.client_time.count());
  for (double now = 0; now < whole; now = SecondsSince(start)) {
    const int64_t bytes = server.ResidentBytes();
    if (now > whole * 2 / 3) {
      memory.last = std::max(memory.last, bytes);
    } else if (now > whole / 3) {
      memory.middle = std::max(memory.middle, bytes);
    }
    std::this_thread::sleep_for(milliseconds(100));
  }
  for (std::jthread& thread : threads) thread.request_stop();
  return memory;  // when every client has come to its end
}

}  // namespace

void ManyClients(const Scale& scale, Report* report) {
  StressServer server;
  server.Start({"--threads", "1", "--queue", "64"});
  server.Jobs().List(1).status().IgnoreError();
  Ledger ledger;
  Tally tally;
  const Memory memory = RunCrowd(scale, server, &ledger, &tally);
  report->Expect(
      kClientsPart,
      absl::StrFormat("%d clients for %d s, a third cancel or cut the line: no wrong answer",
                      kClients, scale.client_time.count()),
      tally.wrong == 0 && tally.ended_twice == 0 && tally.whole > 0 && tally.broken > 0,
      absl::StrFormat("%d surfaces right, %d broken by their clients, %d told to come back, "
                      "%d wrong, %d ended twice%s%s",
                      tally.whole.load(), tally.broken.load(), tally.turned.load(),
                      tally.wrong.load(), tally.ended_twice.load(),
                      tally.first_fault.empty() ? "" : "; ", tally.first_fault));
  const Audit audit = ledger.Check(server);
  report->Expect(kClientsPart, "no job lost or doubled, the bytes of an undisturbed run",
                 audit.clean(), audit.Words());
  report->Expect(
      kClientsPart, "memory level: last third at most 16 MB over the middle one",
      memory.last - memory.middle < kMostCrowdGrowth,
      absl::StrFormat("%.1f MB, then %.1f MB", Megabytes(memory.middle), Megabytes(memory.last)));
  const bool empty = WaitFor(
      seconds(5), [&] { return server.Connections() == 0 && server.process().Workers().empty(); });
  const int files = server.OpenFiles();
  const auto start = std::chrono::steady_clock::now();
  // It waits for calls under way before it ends.
  const bool ended = server.EndsWithin(seconds(2));
  report->Expect(kClientsPart, "no stream, job or worker left: SIGTERM ends it within 2 s",
                 empty && ended,
                 absl::StrFormat("%d connections, %d workers, %d files open; ended in %.2f s",
                                 empty ? 0 : server.Connections(),
                                 server.process().Workers().size(), files, SecondsSince(start)));
}

}  // namespace rilievo::stress
