#include "server/worker/run_worker_job.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include "core/base/sanitized.h"
#include "server/os/unnamed_file.h"
#include "server/worker/message_channel.h"
#include "server/worker/worker_process.h"
#include "server/worker/worker_protocol.pb.h"
#include "tests/unit/server/worker/moody_worker.h"

namespace rilievo {
namespace {

WorkerProcess StartMoody(const std::vector<FileDescriptor>& scratch = {}) {
  FileDescriptor points(memfd_create("points", MFD_CLOEXEC));
  const std::string zeros(20 * 12, '\0');
  EXPECT_TRUE(points.Write(zeros.data(), zeros.size()).ok());
  return *WorkerProcess::Start(*WorkerProgram::Open(RILIEVO_MOODY_WORKER), points, scratch);
}

worker::JobOrder Order(Mood mood) {
  worker::JobOrder order;
  order.set_version(RILIEVO_VERSION);
  order.mutable_header()->set_point_count(20);
  order.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  order.mutable_header()->mutable_options()->set_seed(static_cast<uint64_t>(mood));
  order.set_max_surface_faces(1'000'000);
  order.set_threads(1);
  return order;
}

// The first message that says how the job ended.
worker::WorkerMessage Answer(const WorkerProcess& process) {
  worker::WorkerMessage message;
  do {
    EXPECT_TRUE(ReceiveMessage(process.socket(), &message).ok());
  } while (message.has_ready() || message.has_progress());
  return message;
}

TEST(RunWorkerJob, AnswersInTheProtocolsOrder) {
  WorkerProcess process = StartMoody();
  ASSERT_TRUE(SendMessage(process.socket(), Order(Mood::kWell)).ok());
  worker::WorkerMessage message;
  ASSERT_TRUE(ReceiveMessage(process.socket(), &message).ok());
  EXPECT_EQ(message.ready().version(), RILIEVO_VERSION);
  ASSERT_TRUE(ReceiveMessage(process.socket(), &message).ok());
  EXPECT_TRUE(message.has_progress());
  ASSERT_TRUE(ReceiveMessage(process.socket(), &message).ok());
  ASSERT_TRUE(message.has_result());
  EXPECT_EQ(message.result().chunk_bytes_size(), 4);
  size_t bytes = 0;
  while (ReceiveMessage(process.socket(), &message).ok()) bytes += message.piece().size();
  EXPECT_EQ(bytes, 3'000'010u);
}

TEST(RunWorkerJob, TheFilesOfTheOrderAloneAreWritten) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer needs more than a job";
  for (const int files : {0, 2}) {
    std::vector<FileDescriptor> scratch;
    for (int i = 0; i < 3; ++i) scratch.push_back(*UnnamedFile(testing::TempDir()));
    WorkerProcess process = StartMoody(std::move(scratch));
    worker::JobOrder order = Order(Mood::kWriting);
    order.set_scratch_files(files);
    if (files > 0) order.set_part_points(2048);
    if (files > 0) order.set_scratch_bytes(4000);
    ASSERT_TRUE(SendMessage(process.socket(), order).ok());
    EXPECT_EQ(Answer(process).result().report().road_reason(),
              files > 0 ? " place0 cut0 place1 cut1" : "");
  }
}

TEST(RunWorkerJob, AnotherVersionIsRefused) {
  WorkerProcess process = StartMoody();
  worker::JobOrder order = Order(Mood::kWell);
  order.set_version("0.0.0");
  ASSERT_TRUE(SendMessage(process.socket(), order).ok());
  worker::WorkerMessage first;  // before it says that it is ready
  ASSERT_TRUE(ReceiveMessage(process.socket(), &first).ok());
  EXPECT_NE(first.failure().text().find("0.0.0"), std::string::npos);
}

TEST(RunWorkerJob, AHeaderThatIsWrongIsAFailureWithItsCode) {
  WorkerProcess process = StartMoody();
  worker::JobOrder order = Order(Mood::kWell);
  order.mutable_header()->set_point_count(3);
  ASSERT_TRUE(SendMessage(process.socket(), order).ok());
  EXPECT_EQ(Answer(process).failure().code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
}

TEST(RunWorkerJob, EndsWhenTheServerIsGone) {
  WorkerProcess process = StartMoody();
  ASSERT_TRUE(SendMessage(process.socket(), Order(Mood::kSleep)).ok());
  worker::WorkerMessage message;
  while (!message.has_progress()) {  // it has begun
    ASSERT_TRUE(ReceiveMessage(process.socket(), &message).ok());
  }
  shutdown(process.socket().number(), SHUT_WR);  // what a dead server leaves
  char byte;
  EXPECT_EQ(process.socket().Read(&byte, 1).code(), absl::StatusCode::kOutOfRange);
  const int status = process.End();
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(WorkerExit::kAbandoned));
}

}  // namespace
}  // namespace rilievo
