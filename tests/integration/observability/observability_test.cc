// What an operator sees of a server from outside: metrics, log, health, channelz, reflection.
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "client/library/connect.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "server/auth/access_tokens.h"
#include "server/auth/token_file.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;
using testing::Not;

std::string Output(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  std::string out;
  char buffer[4096];
  for (size_t n; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) out.append(buffer, n);
  pclose(pipe);
  return out;
}

// What follows `words` in a message of the log.
std::string LoggedAddress(const DaemonProcess& daemon, const std::string& words) {
  const auto line = daemon.WaitForLine(words, seconds(10));
  if (!line) return "";
  const size_t begin = line->find(words) + words.size();
  return line->substr(begin, line->find('"', begin) - begin);
}

// How a call with one empty message ends.
grpc::Status CallByName(const std::shared_ptr<grpc::ChannelInterface>& channel,
                        const std::string& name, grpc::ByteBuffer* response) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + seconds(10));
  context.set_wait_for_ready(true);
  grpc::CompletionQueue queue;
  const grpc::Slice empty;
  const auto call = stub.PrepareUnaryCall(&context, name, grpc::ByteBuffer(&empty, 1), &queue);
  call->StartCall();
  grpc::Status status;
  call->Finish(response, &status, nullptr);
  void* tag;
  bool ok;
  queue.Next(&tag, &ok);
  return status;
}

class ObservabilityTest : public JobsTest {
 protected:
  std::string Metrics() const {
    return Output("curl -s --max-time 10 " + LoggedAddress(*daemon_, "metrics at "));
  }

  // The value of a line of the metrics; -1 when there is none.
  double Metric(const std::string& name) const {
    const std::string text = "\n" + Metrics();
    const size_t at = text.find("\n" + name + " ");
    return at == std::string::npos ? -1 : std::stod(text.substr(at + name.size() + 2));
  }
};

TEST_F(ObservabilityTest, MetricsTellOfJobsStagesAndBytes) {
  StartServer({"--metrics", "127.0.0.1:0"});
  const PointCloud scan = SphereScan(2'000);
  const auto called = ReconstructionClient(Channel()).Reconstruct(scan, {});
  ASSERT_TRUE(called.ok()) << called.status();
  const auto job = Client().Submit(PackScan(scan), {}, "one");
  ASSERT_TRUE(Client().Watch(job->job_id()).ok());
  const auto fetched = Client().Fetch(job->job_id());
  daemon_->WaitForLine("\"id\":\"" + job->job_id(), seconds(10));
  EXPECT_EQ(Metric("rilievo_jobs_ended_total{kind=\"call\",status=\"OK\"}"), 1);
  EXPECT_EQ(Metric("rilievo_jobs_ended_total{kind=\"kept\",status=\"OK\"}"), 1);
  EXPECT_EQ(Metric("rilievo_stage_seconds_count{stage=\"domain_fit\"}"), 2);
  EXPECT_EQ(Metric("rilievo_received_bytes_total"), 2 * 24 * 2'000);
  EXPECT_EQ(Metric("rilievo_sent_bytes_total"),
            static_cast<double>(called->dss.size() + fetched->size()));
  EXPECT_EQ(Metric("rilievo_jobs{state=\"running\"}"), 0);
  EXPECT_GT(Metric("process_resident_memory_bytes"), 1e6);
}

// A panel that asks for a metric that does not exist stays empty and says nothing, and so does a
// metric that no panel asks for.
TEST_F(ObservabilityTest, TheDashboardShowsTheMetricsThatThereAre) {
  StartServer({"--metrics", "127.0.0.1:0"});
  const auto job = Client().Submit(PackScan(SphereScan(500)), {}, "one");
  ASSERT_TRUE(job.ok());
  ASSERT_TRUE(Client().Watch(job->job_id()).ok());
  daemon_->WaitForLine("\"id\":\"" + job->job_id(), seconds(10));
  std::ifstream file(RILIEVO_SOURCE_FOLDER "/deploy/grafana/rilievod.json");
  const auto dashboard = nlohmann::json::parse(file);
  EXPECT_GE(dashboard["panels"].size(), 8u);
  const std::string metrics = Metrics();
  const std::regex name("(rilievo|process)_[a-z_]+");
  for (const auto& panel : dashboard["panels"]) {
    for (const auto& target : panel["targets"]) {
      const std::string expression = target["expr"];
      int names = 0;
      for (std::sregex_iterator match(expression.begin(), expression.end(), name), end;
           match != end; ++match, ++names) {
        EXPECT_THAT(metrics, testing::AnyOf(HasSubstr("\n" + match->str() + " "),
                                            HasSubstr("\n" + match->str() + "{")));
      }
      EXPECT_GT(names, 0) << expression;
    }
  }
  const std::string shown = dashboard.dump();
  const std::regex type("# TYPE ((rilievo|process)_[a-z_]+) ");
  int families = 0;
  for (std::sregex_iterator match(metrics.begin(), metrics.end(), type), end; match != end;
       ++match, ++families) {
    EXPECT_TRUE(std::regex_search(
        shown, std::regex("\\b" + (*match)[1].str() + "(_bucket|_sum|_count)?\\b")))
        << (*match)[1];
  }
  EXPECT_GE(families, 14);
}

TEST_F(ObservabilityTest, AJobIsCountedOnceHoweverOftenItIsTried) {
  StartServer({"--metrics", "127.0.0.1:0"});
  const auto job = Client().Submit(PackScan(SphereScan(60'000)), {}, "one");
  ASSERT_TRUE(job.ok());
  const pid_t worker = daemon_->WaitForWorker(seconds(10));
  ASSERT_GT(worker, 0);
  kill(worker, SIGKILL);
  const auto done = Client().Watch(job->job_id());
  ASSERT_EQ(done->state(), v1::JOB_STATE_SUCCEEDED) << done.status();
  EXPECT_EQ(done->attempts(), 2u);
  EXPECT_EQ(Metric("rilievo_jobs_ended_total{kind=\"kept\",status=\"OK\"}"), 1);
  EXPECT_EQ(Metric("rilievo_attempts_ended_total{status=\"OK\"}"), 1);
  EXPECT_EQ(Metric("rilievo_attempts_ended_total{status=\"ABORTED\"}"), 1);
  const std::string metrics = Metrics();
  const std::string name = "\nrilievo_jobs_ended_total{kind=\"kept\"";
  EXPECT_EQ(metrics.find(name), metrics.rfind(name)) << "under one status alone";
}

TEST_F(ObservabilityTest, MetricsTellOfWhatWaits) {
  StartServer({"--metrics", "127.0.0.1:0", "--max-concurrent-jobs", "1"});
  const PackedScan scan = PackScan(SphereScan(200'000));
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(Client().Submit(scan, {}, id).ok());
  ASSERT_GT(daemon_->WaitForWorker(seconds(10)), 0);
  EXPECT_EQ(Metric("rilievo_jobs{state=\"running\"}"), 1);
  EXPECT_EQ(Metric("rilievo_jobs{state=\"queued\"}"), 2);
  const double first = Metric("rilievo_queue_oldest_seconds");
  EXPECT_GT(first, 0);
  EXPECT_GT(Metric("rilievo_queue_oldest_seconds"), first);
}

TEST_F(ObservabilityTest, RefusalsAreCountedByTheirReason) {
  const NewToken alice = *MakeToken("alice"), bob = *MakeToken("bob");
  for (const NewToken* token : {&alice, &bob}) {
    ASSERT_TRUE(AddTokenLine(test_ / "tokens", token->line).ok());
  }
  StartServer({"--metrics", "127.0.0.1:0", "--tokens", test_ / "tokens", "--max-points", "1000"});
  const auto client = [&](const std::string& token) {
    return JobsClient(*Connect(address_, {.token = token}), {.attempts = 1});
  };
  EXPECT_FALSE(client("").List(1).ok());
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(client("alice.wrong").List(1).ok());
  const auto job = client(alice.token).Submit(PackScan(SphereScan(100)), {}, "one");
  ASSERT_TRUE(job.ok()) << job.status();
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(client(bob.token).Get(job->job_id()).ok());
  EXPECT_FALSE(ReconstructionClient(*Connect(address_, {.token = bob.token}))
                   .Reconstruct(SphereScan(1001), {})
                   .ok());
  EXPECT_EQ(Metric("rilievo_refusals_total{reason=\"NO_TOKEN\"}"), 1);
  EXPECT_EQ(Metric("rilievo_refusals_total{reason=\"WRONG_TOKEN\"}"), 2);
  EXPECT_EQ(Metric("rilievo_refusals_total{reason=\"OTHER_OWNER\"}"), 3);
  EXPECT_EQ(Metric("rilievo_refusals_total{reason=\"LIMIT_EXCEEDED\"}"), 1);
  EXPECT_THAT(Metrics(), Not(HasSubstr("alice"))) << "whoever scrapes learns no names";
}

TEST_F(ObservabilityTest, AJobLeavesOneJsonLineWithItsTrace) {
  StartServer();
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  grpc::ClientContext context;
  context.AddMetadata("traceparent", "00-" + trace + "-00f067aa0ba902b7-01");
  const PackedScan scan = PackScan(SphereScan(500));
  ASSERT_TRUE(Client().Upload(scan).ok());
  v1::CreateJobRequest request;
  request.set_request_id("one");
  request.set_scan_id(scan.scan_id);
  request.mutable_header()->set_point_count(scan.header.point_count());
  request.mutable_header()->set_coordinate_format(scan.header.coordinate_format());
  v1::CreateJobResponse response;
  ASSERT_TRUE(v1::JobsService::NewStub(Channel())->CreateJob(&context, request, &response).ok());
  EXPECT_EQ(response.job().trace_id(), trace);
  const auto line = daemon_->WaitForLine(trace, seconds(20));
  ASSERT_TRUE(line.has_value());
  const auto entry = nlohmann::json::parse(*line);
  EXPECT_EQ(entry["event"], "job");
  EXPECT_EQ(entry["id"], response.job().job_id());
  EXPECT_EQ(entry["trace_id"], trace);
  EXPECT_EQ(entry["status"], "OK");
  EXPECT_EQ(entry["points"], 500);
  EXPECT_GT(entry["bytes_out"], 0);
  EXPECT_TRUE(entry["stages"].contains("domain_fit"));

  // The call of Reconstruct, by a client that is part of no trace.
  ASSERT_TRUE(ReconstructionClient(Channel()).Reconstruct(SphereScan(500), {}).ok());
  const auto called = daemon_->WaitForLine("\"job\":2,", seconds(10));
  ASSERT_TRUE(called.has_value());
  EXPECT_FALSE(nlohmann::json::parse(*called).contains("trace_id"));
}

// The watcher sees the change while a job still runs and the server still answers.
TEST_F(ObservabilityTest, HealthTurnsBeforeTheDrain) {
  StartServer({"--drain-seconds", "60"});
  const auto health = grpc::health::v1::Health::NewStub(Channel());
  grpc::ClientContext context;
  const auto watch = health->Watch(&context, {});
  grpc::health::v1::HealthCheckResponse now;
  ASSERT_TRUE(watch->Read(&now));
  EXPECT_EQ(now.status(), grpc::health::v1::HealthCheckResponse::SERVING);
  std::stop_source stop;
  ReconstructCallbacks callbacks;
  callbacks.progress = [&](const v1::Progress& progress) {
    if (progress.stage() < v1::STAGE_CHECK || stop.stop_requested()) return;
    daemon_->Signal(SIGTERM);
    ASSERT_TRUE(watch->Read(&now));
    EXPECT_EQ(now.status(), grpc::health::v1::HealthCheckResponse::NOT_SERVING);
    EXPECT_FALSE(daemon_->WaitForExit(std::chrono::milliseconds(300)).has_value());
    stop.request_stop();
  };
  const auto ended = ReconstructionClient(Channel()).Reconstruct(
      SphereScan(300'000), {}, callbacks, {.timeout = {}, .stop = stop.get_token()});
  EXPECT_TRUE(absl::IsCancelled(ended.status())) << ended.status();
  context.TryCancel();
  EXPECT_EQ(daemon_->WaitForExit(seconds(10)), 0);
}

TEST_F(ObservabilityTest, ChannelzHasAPortOfItsOwn) {
  const std::string name = "/grpc.channelz.v1.Channelz/GetServers";
  StartServer({"--channelz", "127.0.0.1:0"});
  const std::string address = LoggedAddress(*daemon_, "channelz at ");
  grpc::ByteBuffer response;
  EXPECT_TRUE(CallByName(ConnectPlaintext(address), name, &response).ok());
  EXPECT_GT(response.Length(), 0u);
  EXPECT_EQ(CallByName(Channel(), name, &response).error_code(), grpc::StatusCode::UNIMPLEMENTED)
      << "not where clients are";
}

TEST_F(ObservabilityTest, ReflectionIsOffWhereCallersMustProveThemselves) {
  ASSERT_TRUE(AddTokenLine(test_ / "tokens", MakeToken("alice")->line).ok());
  const auto reflects = [&](const std::vector<std::string>& arguments) {
    StartServer(arguments);
    grpc::ByteBuffer response;
    return CallByName(Channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                      &response)
               .error_code() != grpc::StatusCode::UNIMPLEMENTED;
  };
  EXPECT_TRUE(reflects({}));
  EXPECT_FALSE(reflects({"--reflection", "off"}));
  EXPECT_FALSE(reflects({"--tokens", test_ / "tokens"}));
  EXPECT_TRUE(reflects({"--tokens", test_ / "tokens", "--reflection", "on"}));
}

}  // namespace
}  // namespace rilievo
