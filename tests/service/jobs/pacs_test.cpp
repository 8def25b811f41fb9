#include "service/jobs/pacs.h"

#include <gmock/gmock.h>

#include <map>
#include <set>

#include "tests/service/jobs/service_fixture.h"
#include "tests/support/disk_calls.h"

namespace volsmooth {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

/// A node that does what the test says: is down, has a series, refuses instances.
struct FakeNode {
  std::atomic<bool> up = true, has_series = true, silent = false;
  std::atomic<int> asked = 0;
  std::mutex mutex;
  std::vector<std::string> received;
  std::string refuses;
  std::set<std::string> askers;  ///< the tenants of all exchanges

  static NodeFailure down() { return {{"node-unreachable", "It is down."}, true}; }

  void note(const std::string& tenant) {
    const std::lock_guard lock(mutex);
    ++asked;
    askers.insert(tenant);
  }

  Pacs pacs() {
    Pacs pacs;
    pacs.nodes = {{"archive", true}, {"printer", false}};
    pacs.retrieve = [this](const std::string& tenant, const DicomSource&, IncomingFile& file,
                           const Progress& report) -> tl::expected<void, NodeFailure> {
      note(tenant);
      report(0.5);
      if (!up) return tl::unexpected(down());
      if (!has_series) return tl::unexpected(NodeFailure{{"source-not-found", "Not there."}, false});
      const std::string series = "series";
      file.write(std::as_bytes(std::span(series)));
      return {};
    };
    pacs.instances_in = [](const std::filesystem::path& file) {
      const std::string stem = file.filename();
      return std::vector<DicomInstance>{{"1.2", stem + ".1", {}}, {"1.2", stem + ".2", {}}};
    };
    pacs.send = [this](const std::string& tenant, const std::string&, const std::filesystem::path&,
                       std::span<const DicomInstance> instances, const auto& on_answers,
                       const auto& keep_going) -> tl::expected<void, NodeFailure> {
      note(tenant);
      for (int tries = 0; silent && tries < 6000; ++tries) {
        keep_going();
        std::this_thread::sleep_for(10ms);
      }
      for (const DicomInstance& instance : instances) {
        if (!up) return tl::unexpected(down());
        const bool stored = instance.sop_instance_uid != refuses;
        {
          const std::lock_guard lock(mutex);
          received.push_back(instance.sop_instance_uid);
        }
        const std::vector<InstanceAnswer> answers = {
            {instance.sop_instance_uid, stored, stored ? "" : "0xA700"}};
        on_answers(answers);
        if (go_down_after_each) up = false;
      }
      return {};
    };
    return pacs;
  }
  std::atomic<bool> go_down_after_each = false;
};

class PacsJobs : public JobServiceTest {
 protected:
  void open() {
    auto engine = fake_.engine();
    engine.compute = [this](const ComputeTask& task,
                            const StageProgress&) -> tl::expected<std::vector<Result>, Problem> {
      seen_volume_ = task.order.volume;
      std::ofstream(task.output_dir / "out.zip") << "x";
      std::ofstream(task.output_dir / "report.json") << "{}";
      return std::vector<Result>{FakeEngine::result("out.zip", "series"),
                                 FakeEngine::result("report.json", "report")};
    };
    if (fake_instances_)
      engine.instances = [](const auto&, const auto&) -> tl::expected<std::vector<ArrivedInstance>, Problem> {
        return std::vector<ArrivedInstance>{{"1.2", "1.2.3", "1.2.3.4", "1.2.3.4.5", 0, 1}};
      };
    service_.reset();
    JobServiceSettings given = settings();
    given.longest_node_pause = 20ms;
    given.node_patience = patience_;
    given.tenant_max_bytes = quota_;
    service_ = std::make_unique<JobService>(given, engine, pacs_ ? *pacs_ : node_.pacs());
    service_->start();
  }

  static JobOrder source_order() {
    JobOrder order;
    order.source = DicomSource{"archive", "1.2.3", "1.2.3.4"};
    return order;
  }
  JobOrder delivery_order() {
    JobOrder order = order_for(upload(*service_, "series").value().id);
    order.outputs = {"dicom-series"};
    order.destination = "printer";
    return order;
  }
  /// The job once its delivery is in `state`.
  Job delivered(const std::string& id, DeliveryState state) {
    for (int tries = 0; tries < 6000; ++tries) {
      Job job = service_->job(kAnyone, id).value();
      if (job.delivery && job.delivery->state == state) return job;
      std::this_thread::sleep_for(10ms);
    }
    throw std::runtime_error("the delivery did not get there");
  }

  /// Until the delivery of a job was tried, and postponed.
  void wait_for_a_try(const std::string& id) {
    while (!service_->job(kAnyone, id)->delivery || service_->job(kAnyone, id)->delivery->tries == 0)
      std::this_thread::sleep_for(1ms);
  }

  FakeNode node_;
  std::optional<Pacs> pacs_;  ///< in place of the node's
  std::chrono::milliseconds patience_ = 1h;
  std::int64_t quota_ = 0;
  bool fake_instances_ = false;  ///< any file holds one
  std::string seen_volume_;
};

/// The actions of the audit that concern an object.
std::vector<std::string> audited(const std::filesystem::path& data, const std::string& object) {
  Database database(data / "volsmooth.db", Database::Access::kReader);
  return all_of(
      database.query("SELECT action || ': ' || outcome FROM audit WHERE subject = ? ORDER BY sequence",
                     object),
      [](const Statement& row) { return row.text(0); });
}

TEST_F(PacsJobs, ASeriesIsFetchedAndThenComputedOn) {
  open();
  const Job queued = service_->submit(kAnyone, source_order()).value();
  EXPECT_EQ(queued.order.volume, "");
  const Job done = wait_for(*service_, queued.id);
  EXPECT_EQ(done.state, JobState::kSucceeded);
  ASSERT_EQ(service_->volumes(kAnyone)->volumes.size(), 1U);
  EXPECT_EQ(service_->volumes(kAnyone)->volumes[0].options.series, "1.2.3.4");
  EXPECT_EQ(done.order.volume, service_->volumes(kAnyone)->volumes[0].id);
  EXPECT_EQ(seen_volume_, done.order.volume);
  EXPECT_EQ(done.order.source->study, "1.2.3");
  EXPECT_EQ(node_.asked, 1);
}

TEST_F(PacsJobs, ASeriesThatMayNotBeKeptWaitsUntilThereIsRoom) {
  quota_ = 10;
  open();
  const auto other = upload(*service_, "12345").value();
  const std::string id = service_->submit(kAnyone, source_order()).value().id;
  Job waiting;
  while (!waiting.error) waiting = service_->job(kAnyone, id).value();
  EXPECT_EQ(waiting.error->slug, "quota");
  EXPECT_EQ(service_->volumes(kAnyone)->volumes.size(), 1U);
  ASSERT_TRUE(service_->delete_volume(kAnyone, other.id));
  EXPECT_EQ(wait_for(*service_, id, JobState::kSucceeded).error, std::nullopt);
}

TEST_F(PacsJobs, ASeriesWhoseResultsMayNotFitOnTheDiskWaits) {
  patience_ = 50ms;
  fake_.disk_bytes = std::int64_t{1} << 60;
  open();
  const Job failed = wait_for(*service_, service_->submit(kAnyone, source_order()).value().id);
  EXPECT_EQ(failed.state, JobState::kFailed);
  EXPECT_EQ(failed.error->slug, "insufficient-storage");
  EXPECT_TRUE(service_->volumes(kAnyone)->volumes.empty());
  const auto volumes = std::filesystem::directory_iterator(settings().data_dir / "volumes");
  EXPECT_EQ(std::distance(begin(volumes), end(volumes)), 0);
}

/// Until the ballast goes, which makes room for what says that it waits.
TEST_F(PacsJobs, ASeriesWhoseRowDoesNotFitOnTheDiskWaits) {
  open();
  const DiskCalls disk(settings().data_dir, [this, full = true](const std::string& call) mutable {
    if (call == "fsync ballast") full = false;
    return full && node_.asked == 1 && call == "write volsmooth.db-wal" ? ENOSPC : 0;
  });
  const Job done = wait_for(*service_, service_->submit(kAnyone, source_order()).value().id);
  EXPECT_EQ(done.state, JobState::kSucceeded) << (done.error ? done.error->slug : "");
  EXPECT_EQ(node_.asked, 2);
}

TEST_F(PacsJobs, TheAuditSaysWhereADeliveryWent) {
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  delivered(id, DeliveryState::kDelivered);
  const auto well = audited(settings().data_dir, id);
  EXPECT_EQ(std::vector(well.end() - 2, well.end()),
            (std::vector<std::string>{"sending to printer: done", "delivered to printer: done"}));

  node_.refuses = "out.zip.1";
  const std::string refused = service_->submit(kAnyone, delivery_order()).value().id;
  delivered(refused, DeliveryState::kFailed);
  const auto ill = audited(settings().data_dir, refused);
  EXPECT_EQ(
      std::vector(ill.end() - 2, ill.end()),
      (std::vector<std::string>{"sending to printer: done", "delivery failed to printer: delivery-refused"}));
}

TEST_F(PacsJobs, AJobWaitsForASourceThatIsDown) {
  node_.up = false;
  open();
  const std::string id = service_->submit(kAnyone, source_order()).value().id;
  Job waiting;
  while (waiting.source_tries < 2) waiting = service_->job(kAnyone, id).value();
  EXPECT_EQ(waiting.progress.stage == "retrieve" || waiting.error->slug == "node-unreachable", true);
  node_.up = true;
  EXPECT_EQ(wait_for(*service_, id).state, JobState::kSucceeded);
  EXPECT_FALSE(service_->job(kAnyone, id)->error);
}

TEST_F(PacsJobs, AWaitingJobSaysWhyAndUntilWhen) {
  node_.up = false;
  open();
  const std::string id = service_->submit(kAnyone, source_order()).value().id;
  for (;;) {
    const Job job = service_->job(kAnyone, id).value();
    if (job.progress.stage != "waiting-for-source") continue;
    EXPECT_EQ(job.state, JobState::kQueued);
    EXPECT_EQ(job.error->slug, "node-unreachable");
    EXPECT_TRUE(job.next_attempt_at);
    break;
  }
  ASSERT_TRUE(service_->cancel(kAnyone, id));  // it may just be asking again
  EXPECT_EQ(wait_for(*service_, id).state, JobState::kCancelled);
  EXPECT_TRUE(service_->volumes(kAnyone)->volumes.empty());
}

TEST_F(PacsJobs, WaitingSurvivesARestart) {
  node_.up = false;
  open();
  const std::string id = service_->submit(kAnyone, source_order()).value().id;
  while (service_->job(kAnyone, id)->source_tries < 1) std::this_thread::sleep_for(1ms);
  service_.reset();
  node_.up = true;
  open();
  EXPECT_EQ(wait_for(*service_, id).state, JobState::kSucceeded);
}

TEST_F(PacsJobs, PatienceEnds) {
  node_.up = false;
  patience_ = 50ms;
  open();
  const Job failed = wait_for(*service_, service_->submit(kAnyone, source_order()).value().id);
  EXPECT_EQ(failed.state, JobState::kFailed);
  EXPECT_EQ(failed.error->slug, "node-unreachable");
}

/// Also when no node and no preset is left, so that nothing would have to be exchanged with anybody.
TEST_F(PacsJobs, WhatNamesANodeThatTheConfigurationLostFails) {
  node_.up = false;
  open();
  const std::string waiting = service_->submit(kAnyone, source_order()).value().id;
  const std::string undelivered = service_->submit(kAnyone, delivery_order()).value().id;
  wait_for(*service_, undelivered);
  service_.reset();

  const auto gone = [] { return tl::unexpected(NodeFailure{{"node-unreachable", "It is gone."}, false}); };
  pacs_ = node_.pacs();
  pacs_->nodes.clear();
  pacs_->retrieve = [=](auto&&...) { return gone(); };
  pacs_->send = [=](auto&&...) { return gone(); };
  open();
  EXPECT_EQ(wait_for(*service_, waiting).error->detail, "It is gone.");
  EXPECT_EQ(delivered(undelivered, DeliveryState::kFailed).delivery->error->detail, "It is gone.");
}

/// The two nodes are ward-a's; what is there for everybody is "common", that for ward-b is "b".
class NodesOfTenants : public PacsJobs {
 protected:
  NodesOfTenants() {
    pacs_ = node_.pacs();
    for (Pacs::Node& node : pacs_->nodes) node.tenants = {"ward-a"};
    pacs_->nodes.push_back({"common", true});
    pacs_->nodes.push_back({"b", true, {"ward-c", "ward-b"}});
    open();
  }
  /// What a caller is told who names that node, as the source or as the destination.
  std::string told(const Caller& caller, const std::string& node, bool as_source) {
    JobOrder order = source_order();
    order.outputs = {"dicom-series"};
    order.source->node = as_source ? node : "common";
    if (!as_source) order.destination = node;
    const auto answer = service_->submit(caller, order);
    return answer ? "taken" : answer.error().slug + answer.error().detail + answer.error().members.dump();
  }
  auto send_to_preset(const Caller& caller, const std::string& preset) {
    auto file = service_->begin_arrival().value();
    return service_->receive(caller, preset, std::move(file));
  }

  const Caller alice_{"ward-a", "", {Scope::kAdmin}}, bob_{"ward-b", "", {Scope::kAdmin}};
};

TEST_F(NodesOfTenants, AnothersNodeAnswersLikeOneThatIsNotThere) {
  for (const bool as_source : {true, false}) {
    const std::string none = told(bob_, "nobody", as_source);
    EXPECT_THAT(none, HasSubstr(R"("choices":["common","b"])"));
    EXPECT_EQ(told(bob_, "archive", as_source), none);
    EXPECT_EQ(told(bob_, "printer", as_source), none);
    EXPECT_EQ(told(alice_, "b", as_source), told(alice_, "nobody", as_source));
    for (const char* node : {"b", "common"}) EXPECT_EQ(told(bob_, node, as_source), "taken");
    for (const char* node : {"archive", "common"}) EXPECT_EQ(told(alice_, node, as_source), "taken");
    EXPECT_EQ(told(kAnyone, "common", as_source), "taken");
    EXPECT_EQ(told(kAnyone, "archive", as_source), told(kAnyone, "printer1", as_source));
  }
  EXPECT_EQ(told(alice_, "printer", false), "taken");
}

/// So the network's side, which knows the nodes, refuses what is not the tenant's any more.
TEST_F(NodesOfTenants, NodesAreAskedInTheNameOfTheJobsTenant) {
  JobOrder order = source_order();
  order.outputs = {"dicom-series"};
  order.destination = "printer";
  node_.silent = true;
  const std::string id = service_->submit(alice_, order).value().id;
  const auto wait_until_asked = [&](int times) {
    for (int tries = 0; tries < 6000 && node_.asked < times; ++tries) std::this_thread::sleep_for(10ms);
    EXPECT_GE(node_.asked, times);
  };
  wait_until_asked(1);
  while (service_->job(alice_, id)->state != JobState::kSucceeded) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(service_->volumes(alice_)->volumes.size(), 1U);
  wait_until_asked(2);
  service_.reset();
  EXPECT_EQ(node_.askers, std::set<std::string>{"ward-a"});
}

/// Its order is the operator's, but what it sends, and in whose name, is its caller's.
TEST_F(NodesOfTenants, APresetIsForWhoeverItsDestinationIsFor) {
  pacs_->presets = {{"to-a", JobOrder{}}, {"to-all", JobOrder{}}, {"to-none", JobOrder{}}};
  for (auto& [preset, node] :
       std::vector<std::pair<std::size_t, std::string>>{{0, "printer"}, {1, "common"}}) {
    pacs_->presets[preset].order.outputs = {"dicom-series"};
    pacs_->presets[preset].order.destination = node;
  }
  pacs_->presets[0].tenant = "ward-a";
  fake_instances_ = true;
  open();
  const auto none = send_to_preset(bob_, "nobody");
  const auto others = send_to_preset(bob_, "to-a");
  EXPECT_EQ(slug_of(none), "not-found");
  EXPECT_EQ(slug_of(others), "not-found");
  EXPECT_EQ(others.error().detail, none.error().detail);
  EXPECT_EQ(slug_of(send_to_preset(alice_, "to-a")), "none");
  for (const Caller& caller : {alice_, bob_})
    for (const char* preset : {"to-all", "to-none"})
      EXPECT_EQ(slug_of(send_to_preset(caller, preset)), "none");
}

TEST_F(NodesOfTenants, APresetWhoseTenantMayNotUseItsNodeStopsTheStart) {
  pacs_->presets = {{"head", JobOrder{}}};
  pacs_->presets[0].order.outputs = {"dicom-series"};
  pacs_->presets[0].order.destination = "printer";
  service_.reset();
  try {
    open();
    FAIL() << "it started";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("preset 'head': its tenant 'default' may not use the node 'printer'"));
  }
  pacs_->presets[0].tenant = "ward-a";
  EXPECT_NO_THROW(open());
}

TEST_F(PacsJobs, AMissingSeriesIsNotAskedForAgain) {
  node_.has_series = false;
  open();
  const Job failed = wait_for(*service_, service_->submit(kAnyone, source_order()).value().id);
  EXPECT_EQ(failed.error->slug, "source-not-found");
  EXPECT_EQ(node_.asked, 1);
}

TEST_F(PacsJobs, BadOrdersAreRefused) {
  open();
  const std::string volume = upload(*service_, "series").value().id;
  const auto refused = [&](const auto& change, const std::string& text) {
    JobOrder order = order_for(volume);
    change(order);
    const auto answer = service_->submit(kAnyone, order);
    ASSERT_FALSE(answer) << text;
    EXPECT_EQ(answer.error().slug, "bad-parameter");
    EXPECT_THAT(answer.error().detail, HasSubstr(text));
  };
  refused([](JobOrder& order) { order.source = source_order().source; }, "without 'volume'");
  refused(
      [](JobOrder& order) {
        order = source_order();
        order.source->node = "printer";
      },
      "'source' must name a node");
  refused([](JobOrder& order) { order.destination = "archive"; }, "DICOM objects only");
  refused(
      [](JobOrder& order) {
        order.destination = "nobody";
        order.outputs = {"dicom-series"};
      },
      "'destination' must name a node");
}

TEST_F(PacsJobs, ResultsGoToTheDestinationOnce) {
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  const Job job = delivered(id, DeliveryState::kDelivered);
  EXPECT_EQ(job.state, JobState::kSucceeded);
  EXPECT_EQ(job.delivery->instances, 2);
  EXPECT_EQ(job.delivery->stored, 2);
  EXPECT_THAT(node_.received, ElementsAre("out.zip.1", "out.zip.2"));
}

/// The node dies after every instance: none is lost, none is sent twice.
TEST_F(PacsJobs, OnlyWhatIsMissingIsSentAgain) {
  node_.go_down_after_each = true;
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  while (true) {
    const Job job = service_->job(kAnyone, id).value();
    if (job.delivery && job.delivery->state == DeliveryState::kDelivered) break;
    EXPECT_TRUE(!job.delivery || job.delivery->tries == 0 || job.delivery->error->slug == "node-unreachable");
    std::this_thread::sleep_for(5ms);
    node_.up = true;
  }
  EXPECT_THAT(node_.received, ElementsAre("out.zip.1", "out.zip.2"));
}

TEST_F(PacsJobs, DeliveryGoesOnAfterARestart) {
  node_.up = false;
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  wait_for_a_try(id);
  service_.reset();
  node_.up = true;
  open();
  EXPECT_EQ(delivered(id, DeliveryState::kDelivered).delivery->stored, 2);
}

TEST_F(PacsJobs, AStopDoesNotWaitForASilentNode) {
  node_.silent = true;
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  while (node_.asked == 0) std::this_thread::sleep_for(1ms);
  const auto begin = std::chrono::steady_clock::now();
  service_.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s);
  node_.silent = false;
  open();
  EXPECT_EQ(delivered(id, DeliveryState::kDelivered).delivery->stored, 2);
}

TEST_F(PacsJobs, ARefusedInstanceFailsTheDeliveryNotTheJob) {
  node_.refuses = "out.zip.2";
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  const Job job = delivered(id, DeliveryState::kFailed);
  EXPECT_EQ(job.state, JobState::kSucceeded);
  EXPECT_EQ(job.delivery->error->slug, "delivery-refused");
  EXPECT_EQ(job.delivery->stored, 1);
  EXPECT_EQ(job.delivery->refused, 1);
  const auto ledger = service_->ledger(kAnyone, id).value();
  ASSERT_EQ(ledger.size(), 2U);
  EXPECT_EQ(ledger[0].state, "stored");
  EXPECT_EQ(ledger[1].state, "refused");
  EXPECT_EQ(ledger[1].reason, "0xA700");
  EXPECT_EQ(ledger[1].instance.result, "out.zip");

  node_.refuses = "";
  service_->deliver_again(kAnyone, id).value();
  EXPECT_EQ(delivered(id, DeliveryState::kDelivered).delivery->stored, 2);
  EXPECT_THAT(node_.received, ElementsAre("out.zip.1", "out.zip.2", "out.zip.2"));
}

TEST_F(PacsJobs, AJobWithoutDestinationHasAnEmptyLedger) {
  open();
  const auto volume = upload(*service_, "series").value();
  const Job done = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  EXPECT_FALSE(done.delivery);
  EXPECT_TRUE(service_->ledger(kAnyone, done.id)->empty());
  EXPECT_FALSE(service_->deliver_again(kAnyone, done.id)->delivery);
  EXPECT_EQ(slug_of(service_->ledger(kAnyone, "j-aaaaaaaaaaaaaaaa")), "not-found");
  EXPECT_EQ(slug_of(service_->deliver_again(kAnyone, "j-aaaaaaaaaaaaaaaa")), "not-found");
}

TEST_F(PacsJobs, ADeletedJobIsNotDelivered) {
  node_.up = false;
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  wait_for_a_try(id);
  ASSERT_TRUE(service_->delete_job(kAnyone, id));
  node_.up = true;
  std::this_thread::sleep_for(100ms);
  EXPECT_TRUE(node_.received.empty());
}

TEST_F(PacsJobs, ADeletedJobIsNotDeliveredAnyFurther) {
  node_.silent = true;
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  while (node_.asked == 0) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(service_->delete_job(kAnyone, id));
  std::this_thread::sleep_for(500ms);  // it is asked whether to go on every 10 ms
  node_.silent = false;
  std::this_thread::sleep_for(100ms);
  EXPECT_TRUE(node_.received.empty());
  EXPECT_EQ(audited(settings().data_dir, id).back(), "job deleted: done");
}

TEST_F(PacsJobs, ADeliveryThatAFullDiskEndsGoesOnWhenThereIsRoom) {
  node_.up = false;
  open();
  const std::string id = service_->submit(kAnyone, delivery_order()).value().id;
  wait_for_a_try(id);
  {
    const DiskCalls disk(settings().data_dir, [](const std::string& call) {
      return call == "write volsmooth.db-wal" ? ENOSPC : 0;
    });
    node_.up = true;
    std::this_thread::sleep_for(300ms);  // it is tried every 20 ms, until the disk ends it
    EXPECT_EQ(service_->job(kAnyone, id)->delivery->state, DeliveryState::kPending);
  }
  EXPECT_EQ(delivered(id, DeliveryState::kDelivered).delivery->stored, 2);
}

/// Instances of the series "1.2.3.<digit>", one a digit of the file.
tl::expected<std::vector<ArrivedInstance>, Problem> instances_of_digits(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string text;
  in >> text;
  if (text == "bad") return tl::unexpected(Problem{"dicom-no-images", "None."});
  std::vector<ArrivedInstance> instances;
  for (std::size_t at = 0; at < text.size(); ++at)
    instances.push_back({"1.2", "9." + text + "." + std::to_string(at), "1.2.3",
                         std::string("1.2.3.") + text[at], static_cast<std::int64_t>(at), 1});
  return instances;
}

class PresetJobs : public JobServiceTest {
 protected:
  void open(std::chrono::milliseconds quiet = 1ms) {
    auto engine = fake_.engine();
    engine.instances = [this](const std::filesystem::path& file, const Progress&) {
      auto instances = instances_of_digits(file);
      if (const auto meanwhile = std::exchange(while_read_, {})) meanwhile();
      return instances;
    };
    if (inspect_)
      engine.inspect = [this, taken = engine.inspect](
                           const auto& file, const auto& options,
                           const auto& report) -> tl::expected<VolumeFacts, Problem> {
        if (auto problem = inspect_()) return tl::unexpected(*std::move(problem));
        return taken(file, options, report);
      };
    Pacs pacs;
    pacs.presets = {{"head", JobOrder{}, quiet}};
    pacs.presets[0].order.label = "sent";
    service_.reset();
    JobServiceSettings given = settings();
    given.longest_node_pause = 20ms;
    given.tenant_max_bytes = quota_;
    service_ = std::make_unique<JobService>(given, engine, pacs);
    service_->start();
  }

  auto send(const std::string& text, const std::string& preset = "head") {
    auto file = service_->begin_upload(kAnyone, {}).value();
    file.write(std::as_bytes(std::span(text)));
    return service_->receive(kAnyone, preset, std::move(file));
  }

  std::vector<Job> jobs_once_there_are(std::size_t count) {
    for (int tries = 0; tries < 6000; ++tries) {
      auto page = service_->jobs(kAnyone, {}).value();
      if (page.jobs.size() == count) return page.jobs;
      std::this_thread::sleep_for(10ms);
    }
    throw std::runtime_error("the jobs did not come");
  }
  std::ptrdiff_t arrived_files() {
    const auto folder = scratch_.path() / "data" / "arrivals";
    if (!std::filesystem::exists(folder)) return 0;
    return std::distance(std::filesystem::directory_iterator(folder), {});
  }

  std::function<std::optional<Problem>()> inspect_;  ///< says what is wrong with a whole series
  std::function<void()> while_read_;                 ///< happens once, while what was sent is read
  std::int64_t quota_ = 0;
};

TEST_F(PresetJobs, WhatDevicesSendIsHeldToTheQuota) {
  quota_ = 3;
  open(1h);
  for (const char* text : {"1", "2", "3"}) ASSERT_TRUE(send(text));
  EXPECT_EQ(arrived_files(), 3);
  auto file = service_->begin_arrival().value();
  const std::string more = "4";
  file.write(std::as_bytes(std::span(more)));
  EXPECT_EQ(slug_of(service_->receive(kAnyone, "head", std::move(file))), "quota");
  EXPECT_EQ(arrived_files(), 3);
}

/// Both were let in when there was room for one of them.
TEST_F(PresetJobs, WhatDevicesSendAtTheSameTimeIsHeldToTheQuota) {
  quota_ = 3;
  open(1h);
  ASSERT_TRUE(send("11"));
  while_read_ = [&] { EXPECT_TRUE(send("2")); };
  const auto refused = send("3");
  EXPECT_EQ(slug_of(refused), "quota");
  EXPECT_EQ(refused.error().members,
            nlohmann::json({{"needed_bytes", 1}, {"used_bytes", 3}, {"limit_bytes", 3}}));
  EXPECT_EQ(arrived_files(), 2) << "the file of the refused one is gone";
}

TEST_F(PresetJobs, WhatArrivesInPiecesBecomesOneJobASeries) {
  open(300ms);
  for (const char* text : {"1", "2", "11", "21"}) ASSERT_TRUE(send(text));
  for (const Job& job : jobs_once_there_are(2)) {
    const Job done = wait_for(*service_, job.id);
    EXPECT_EQ(done.state, JobState::kSucceeded);
    EXPECT_EQ(done.order.label, "sent");
    EXPECT_EQ(done.order.source->preset, "head");
    std::ifstream in(service_->volume_content(kAnyone, done.order.volume)->path);
    const std::string body((std::istreambuf_iterator<char>(in)), {});
    const std::string digit = done.order.source->series.substr(6);
    std::size_t parts = 0;
    for (std::size_t at = 0; (at = body.find("\r\n\r\n" + digit + "\r\n--", at)) != std::string::npos; ++at)
      ++parts;
    EXPECT_EQ(parts, digit == "1" ? 4U : 2U) << body;
  }
  EXPECT_EQ(arrived_files(), 0);
}

TEST_F(PresetJobs, WhatIsSentAgainIsTakenOnce) {
  open(300ms);
  for (int time = 0; time < 3; ++time) ASSERT_TRUE(send("1"));
  const Job done = wait_for(*service_, jobs_once_there_are(1)[0].id);
  std::ifstream in(service_->volume_content(kAnyone, done.order.volume)->path);
  const std::string body((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(body.find("Content-Type"), body.rfind("Content-Type"));
}

TEST_F(PresetJobs, WhatIsSentAgainTakesNoRoom) {
  open(1h);
  for (int time = 0; time < 3; ++time) ASSERT_TRUE(send("1"));
  EXPECT_EQ(arrived_files(), 1);
  ASSERT_TRUE(send("11"));  // other instances, of the same series
  EXPECT_EQ(arrived_files(), 2);
}

/// A device that lost its connection begins again with the first slice, and needs longer than the quiet time
/// to come to those that are new.
TEST_F(PresetJobs, ASeriesIsNotQuietWhileItIsSentAgain) {
  constexpr auto kQuiet = 1s;
  open(kQuiet);
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < 2 * kQuiet) {
    ASSERT_TRUE(send("1"));
    std::this_thread::sleep_for(20ms);
  }
  ASSERT_TRUE(send("11"));
  const auto jobs = jobs_once_there_are(1);
  const Job done = wait_for(*service_, jobs[0].id);
  std::ifstream in(service_->volume_content(kAnyone, done.order.volume)->path);
  const std::string body((std::istreambuf_iterator<char>(in)), {});
  std::size_t parts = 0;
  for (std::size_t at = 0; (at = body.find("Content-Type", at)) != std::string::npos; ++at) ++parts;
  EXPECT_EQ(parts, 3U) << body;
}

/// They were acknowledged, and nothing else holds the series.
TEST_F(PresetJobs, AJobThatFailsWithoutAVolumeKeepsItsArrivalsUntilItIsDeleted) {
  inspect_ = [] { return Problem{"dicom-decode-failed", "Damaged."}; };
  open();
  ASSERT_TRUE(send("1"));
  const std::string id = jobs_once_there_are(1)[0].id;
  EXPECT_EQ(wait_for(*service_, id).state, JobState::kFailed);
  service_->stop();
  EXPECT_EQ(arrived_files(), 1);
  open();
  EXPECT_EQ(arrived_files(), 1);
  ASSERT_TRUE(service_->delete_job(kAnyone, id));
  EXPECT_EQ(arrived_files(), 0);
}

TEST_F(PresetJobs, AReaderThatWasKilledIsTriedAgain) {
  std::atomic<int> tries = 0;
  inspect_ = [&]() -> std::optional<Problem> {
    if (++tries > 2) return std::nullopt;
    return Problem{.slug = "dicom-decode-failed", .detail = "Killed.", .is_passing = true};
  };
  open();
  ASSERT_TRUE(send("1"));
  EXPECT_EQ(wait_for(*service_, jobs_once_there_are(1)[0].id).state, JobState::kSucceeded);
  EXPECT_EQ(tries, 3);
  service_->stop();
  EXPECT_EQ(arrived_files(), 0);
}

TEST_F(PresetJobs, ACancelledJobFreesItsArrivals) {
  inspect_ = [] { return Problem{.slug = "dicom-decode-failed", .detail = "Killed.", .is_passing = true}; };
  open();
  ASSERT_TRUE(send("1"));
  const std::string id = jobs_once_there_are(1)[0].id;
  ASSERT_TRUE(service_->cancel(kAnyone, id));
  EXPECT_EQ(wait_for(*service_, id).state, JobState::kCancelled);
  service_->stop();
  EXPECT_EQ(arrived_files(), 0);
}

TEST_F(PresetJobs, ArrivalsSurviveARestart) {
  open(1h);
  ASSERT_TRUE(send("1"));
  service_.reset();
  EXPECT_EQ(arrived_files(), 1);
  open();
  EXPECT_EQ(wait_for(*service_, jobs_once_there_are(1)[0].id).state, JobState::kSucceeded);
}

TEST_F(PresetJobs, RefusesWhatIsNoDicomAndUnknownPresets) {
  open();
  EXPECT_EQ(slug_of(send("bad")), "dicom-no-images");
  EXPECT_EQ(slug_of(send("1", "foot")), "not-found");
  EXPECT_EQ(arrived_files(), 0);
  EXPECT_TRUE(service_->jobs(kAnyone, {})->jobs.empty());
}

TEST_F(PresetJobs, AnOrderOfAClientCannotNameAPreset) {
  open();
  JobOrder order;
  order.source = DicomSource{"", "1.2.3", "1.2.3.1", "head"};
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order)), "bad-parameter");
}

TEST_F(PresetJobs, APresetThatCannotRunStopsTheStart) {
  Pacs pacs;
  pacs.presets = {{"head", JobOrder{}}};
  pacs.presets[0].order.method = "magic";
  EXPECT_THROW(JobService(settings(), fake_.engine(), pacs), std::runtime_error);
}

}  // namespace
}  // namespace volsmooth
