#include "server/store/job_store.h"

#include <thread>

#include "server/store/content_name.h"
#include "tests/unit/server/store/job_store_fixture.h"

namespace rilievo {
namespace {

using testing::ElementsAre;

TEST_P(JobStoreTest, JobsOutliveTheStore) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  ASSERT_TRUE(store_->Insert(NewJob("b")).ok());
  ASSERT_TRUE(store_->Finish(Finished(NewJob("a")), {{2}}).ok());
  Reopen();
  const auto a = store_->Get("", "a");
  ASSERT_TRUE(a.ok()) << a.status();
  EXPECT_EQ(a->job.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(a->surface, ContentNameOf("\x02"));
  EXPECT_EQ(a->client, "c");
  EXPECT_EQ(a->header.point_count(), 20u);
  const auto unfinished = store_->Unfinished();
  ASSERT_EQ(unfinished->size(), 1u);
  EXPECT_EQ(unfinished->front().job.job_id(), "b");
}

TEST_P(JobStoreTest, TheSameRequestAtOnceMakesOneJob) {
  std::vector<std::string> ids(16);
  {
    const StoredJob original = NewJob("x");
    std::vector<std::jthread> threads;
    for (int i = 0; i < 16; ++i) {
      threads.emplace_back([&, i] {
        StoredJob mine = original;
        mine.job.set_job_id(absl::StrCat("j", i));
        ids[static_cast<size_t>(i)] = store_->Insert(mine)->job.job_id();
      });
    }
  }
  int64_t before = 0;
  EXPECT_EQ(store_->List("", 100, &before)->size(), 1u);
  for (const auto& id : ids) EXPECT_EQ(id, ids[0]);
  StoredJob others = NewJob("x", "somebody else");
  EXPECT_EQ(store_->Insert(others)->job.job_id(), "x") << "request ids are each owner's own";
}

TEST_P(JobStoreTest, AJobNeedsItsScan) {
  StoredJob job = NewJob("a");
  job.job.set_scan_id(ContentNameOf("nothing"));
  EXPECT_EQ(store_->Insert(job).status().code(), absl::StatusCode::kNotFound);
}

TEST_P(JobStoreTest, AScanIsOfThoseWhoSentIt) {
  StoredJob job = NewJob("a", "ann");
  const std::string scan = job.job.scan_id();
  EXPECT_TRUE(store_->BytesOfScan("ann", scan).ok());
  const absl::Status to_bob = store_->BytesOfScan("bob", scan).status();
  EXPECT_TRUE(absl::IsNotFound(to_bob));
  EXPECT_EQ(to_bob, store_->BytesOfScan("bob", ContentNameOf("nothing")).status())
      << "nothing tells that there is one";
  EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("ann", Blob(7)).status()))
      << "no scan: a surface";
  job.owner = "bob";
  EXPECT_TRUE(absl::IsNotFound(store_->Insert(job).status()));
  ASSERT_TRUE(store_->AddScan("bob", scan).ok());
  ASSERT_TRUE(store_->AddScan("bob", scan).ok()) << "again";
  Reopen();
  EXPECT_TRUE(store_->BytesOfScan("bob", scan).ok());
  EXPECT_TRUE(store_->Insert(job).ok());
}

TEST_P(JobStoreTest, AScanThatWasRemovedIsNobodys) {
  const std::string scan = Scan(5, "ann");
  Pass(8 * kDay);
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_TRUE(absl::IsNotFound(store_->blobs().Read(scan).status()));
  EXPECT_EQ(Blob(5), scan) << "somebody else sends it";
  EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("ann", scan).status()));
}

TEST_P(JobStoreTest, AScanGoesWhenNobodyNeedsIt) {
  const StoredJob job = NewJob("a", "ann");
  const std::string scan = job.job.scan_id();
  ASSERT_TRUE(store_->Insert(job).ok());
  ASSERT_TRUE(store_->AddScan("bob", scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->RemoveScan("eve", scan)));
  ASSERT_TRUE(store_->RemoveScan("ann", scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("ann", scan).status()));
  ASSERT_TRUE(store_->RemoveScan("bob", scan).ok());
  EXPECT_TRUE(store_->blobs().Read(scan).ok()) << "a job is not finished";
  ASSERT_TRUE(store_->Finish(Finished(job), {{2}}).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->blobs().Read(scan).status()));
  Counts();
}

TEST_P(JobStoreTest, ARemovedJobTakesItsSurfaceAndScanAlong) {
  for (const char* id : {"a", "b"}) {
    ASSERT_TRUE(store_->Insert(NewJob(id)).ok());
    ASSERT_TRUE(store_->Finish(Finished(NewJob(id)), {std::vector<uint8_t>(9, *id)}).ok());
  }
  EXPECT_EQ(store_->blobs().List()->size(), 3u);
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_EQ(store_->blobs().List()->size(), 2u) << "the other job names the scan too";
  ASSERT_TRUE(store_->Remove("", "b").ok());
  EXPECT_EQ(store_->blobs().List()->size(), 0u);
  EXPECT_EQ(*store_->Clean(), 0);
  EXPECT_EQ(Counts(), "");
}

TEST_P(JobStoreTest, ASurfaceOfTwoJobsStaysForTheOther) {
  for (const char* id : {"a", "b"}) {
    ASSERT_TRUE(store_->Insert(NewJob(id)).ok());
    ASSERT_TRUE(store_->Finish(Finished(NewJob(id)), {{7, 7}}).ok());
  }
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_TRUE(store_->blobs().Read(store_->Get("", "b")->surface).ok());
  Counts();
}

TEST_P(JobStoreTest, AMeshIsABlobWhileItsJobNeedsIt) {
  StoredJob job = NewJob("a");
  v1::ControlMesh mesh;
  mesh.set_positions(std::string(50'000, 'x'));
  *job.header.mutable_options()->mutable_control()->mutable_control_mesh() = mesh;
  const auto kept = store_->Insert(job);
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_FALSE(kept->header.options().control().has_control_mesh());
  EXPECT_EQ(kept->mesh, ContentNameOf(mesh.SerializeAsString()));
  EXPECT_TRUE(store_->blobs().Read(kept->mesh).ok());
  EXPECT_EQ(store_->Unfinished()->front().mesh, kept->mesh);
  ASSERT_TRUE(store_->Finish(Finished(*kept), {{1}}).ok());
  EXPECT_FALSE(store_->blobs().Read(kept->mesh).ok());
  EXPECT_EQ(store_->Get("", "a")->mesh, kept->mesh) << "its name tells requests apart";
  Counts();
}

TEST_P(JobStoreTest, OwnersSeeTheirOwn) {
  ASSERT_TRUE(store_->Insert(NewJob("a", "ann")).ok());
  ASSERT_TRUE(store_->Insert(NewJob("b", "bob")).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Get("bob", "a").status()));
  EXPECT_TRUE(absl::IsNotFound(store_->Get("", "a").status()));
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("bob", 10, &before)), ElementsAre("b"));
  EXPECT_FALSE(store_->Find("bob", "r-a")->has_value());
  EXPECT_TRUE(store_->Find("ann", "r-a")->has_value());
}

TEST_P(JobStoreTest, ListsPagesNewestFirst) {
  for (const auto* id : {"a", "b", "c", "d", "e"}) ASSERT_TRUE(store_->Insert(NewJob(id)).ok());
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("", 2, &before)), ElementsAre("e", "d"));
  EXPECT_NE(before, 0);
  EXPECT_THAT(Ids(*store_->List("", 2, &before)), ElementsAre("c", "b"));
  EXPECT_THAT(Ids(*store_->List("", 2, &before)), ElementsAre("a"));
  EXPECT_EQ(before, 0);
}

TEST_P(JobStoreTest, AFinishedJobStaysAsItIs) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  ASSERT_TRUE(store_->Update(Finished(NewJob("a"))).ok());
  StoredJob again = NewJob("a");
  again.job.set_state(v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(store_->Update(again).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(store_->Get("", "a")->job.state(), v1::JOB_STATE_SUCCEEDED);
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Remove("", "a")));
  EXPECT_EQ(store_->Update(again).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_P(JobStoreTest, PageTokensTellNothingOfOtherOwners) {
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(store_->Insert(NewJob(absl::StrCat("a", i), "ann")).ok());
  for (const auto* id : {"x", "y"}) ASSERT_TRUE(store_->Insert(NewJob(id, "bob")).ok());
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("bob", 1, &before)), ElementsAre("y"));
  EXPECT_EQ(before, 2) << "his second job";
}

TEST_P(JobStoreTest, AScanThatIsLostIsForgotten) {
  const std::string scan = Scan(4, "ann");
  ASSERT_TRUE(store_->blobs().Remove(scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("ann", scan).status()));
  EXPECT_EQ(Scan(4, "ann"), scan) << "sent again";
  EXPECT_EQ(*store_->BytesOfScan("ann", scan), 10);
  ASSERT_TRUE(store_->SetScanAside(scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("ann", scan).status()));
  EXPECT_TRUE(absl::IsNotFound(store_->blobs().Read(scan).status()));
}

TEST_P(JobStoreTest, ASurfaceThatNobodyTakesLeavesNothing) {
  const StoredJob job = NewJob("a");
  ASSERT_TRUE(store_->Insert(job).ok());
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Finish(Finished(job), {{1, 2}})));
  EXPECT_EQ(store_->blobs().List()->size(), 0u);
}

RILIEVO_OF_EVERY_STORE(JobStoreTest);

}  // namespace
}  // namespace rilievo
