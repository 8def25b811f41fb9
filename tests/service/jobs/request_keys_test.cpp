#include "service/jobs/request_keys.h"

#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

using namespace std::chrono_literals;

class RequestKeysTest : public testing::Test {
 protected:
  void remember_one(const std::string& tenant, const RequestKey& key, const std::string& id) {
    database_.write([&](Database& database) {
      remember(database, tenant, key, id, database_.now());
      return true;
    });
  }

  Time now_ = Time(1000h);
  ScratchFolder scratch_;
  StoreDatabase database_{scratch_ / "test.db", std::nullopt, [this] { return now_; }};
  RequestKeys keys_{database_};
};

TEST_F(RequestKeysTest, KnowWhatTheFirstRequestOfEachTenantMade) {
  EXPECT_EQ(keys_.made("a", {"k", "wanted"}).value(), std::nullopt);
  remember_one("a", {"k", "wanted"}, "v-1");
  EXPECT_EQ(keys_.made("a", {"k", "wanted"}).value(), "v-1");
  EXPECT_EQ(slug_of(keys_.made("a", {"k", "other"})), "idempotency-mismatch");
  EXPECT_EQ(keys_.made("b", {"k", "other"}).value(), std::nullopt);
  EXPECT_EQ(keys_.made("a", {"K", "other"}).value(), std::nullopt);
}

TEST_F(RequestKeysTest, AreKeptForADay) {
  remember_one("a", {"k", "wanted"}, "v-1");
  const auto rows = [&] {
    return database_.read([](Database& database) {
      Statement count = database.query("SELECT count(*) FROM request_keys");
      count.step();
      return count.integer(0);
    });
  };
  now_ += 24h - 1s;
  keys_.forget_old();
  EXPECT_EQ(keys_.made("a", {"k", "wanted"}).value(), "v-1");
  now_ += 1s;
  EXPECT_EQ(keys_.made("a", {"k", "other"}).value(), std::nullopt);
  remember_one("a", {"k", "other"}, "v-2");
  EXPECT_EQ(keys_.made("a", {"k", "other"}).value(), "v-2");
  EXPECT_EQ(rows(), 1);
  now_ += 24h;
  keys_.forget_old();
  EXPECT_EQ(rows(), 0);
}

TEST_F(RequestKeysTest, BelongToOneRequestAtATime) {
  auto first = keys_.claim("a", "k");
  ASSERT_TRUE(first);
  EXPECT_EQ(slug_of(keys_.claim("a", "k")), "idempotency-in-flight");
  EXPECT_TRUE(keys_.claim("b", "k"));
  EXPECT_TRUE(keys_.claim("a", "k2"));
  first->reset();
  EXPECT_TRUE(keys_.claim("a", "k"));
}

TEST_F(RequestKeysTest, AreNotKeptAsTheyWereSent) {
  remember_one("a", {"Jane Doe 1970", "wanted"}, "v-1");
  EXPECT_FALSE(database_.read([](Database& database) {
    return database.query("SELECT 1 FROM request_keys WHERE key LIKE '%Jane%'").step();
  }));
}

class RepeatedRequestTest : public JobServiceTest {
 protected:
  tl::expected<StoredVolume, Problem> upload_with(const RequestKey& key) {
    auto file = service_->begin_upload(kAnyone, {});
    file->write(std::as_bytes(std::span("voxels")));
    return service_->keep_volume(kAnyone, *std::move(file), {}, key);
  }
};

TEST_F(RepeatedRequestTest, IsKnownAfterARestart) {
  open();
  const std::string volume = upload_with({"k1", "f1"}).value().id;
  const std::string job = service_->submit(kAnyone, order_for(volume), RequestKey{"k2", "f2"}).value().id;
  service_.reset();
  open();
  EXPECT_EQ(service_->made_by(kAnyone, {"k1", "f1"}).value(), volume);
  EXPECT_EQ(service_->made_by(kAnyone, {"k2", "f2"}).value(), job);
  EXPECT_EQ(slug_of(service_->made_by(kAnyone, {"k2", "f3"})), "idempotency-mismatch");
}

TEST_F(RepeatedRequestTest, OfWhichTheFirstFailedMayBeMadeAnew) {
  open();
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order_for("v-none"), RequestKey{"k", "f"})), "not-found");
  EXPECT_EQ(service_->made_by(kAnyone, {"k", "f"}).value(), std::nullopt);
}

}  // namespace
}  // namespace volsmooth
