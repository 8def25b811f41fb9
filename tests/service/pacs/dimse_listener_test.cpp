#include "service/pacs/dimse_listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>

#include "tests/support/loopback.h"
#include "tests/support/raw_association.h"

namespace volsmooth {
namespace {

using namespace volsmooth::test;

/// A listener whose associations are asked for by RAW, for HEAD, from 127.0.0.1.
class DimseListening : public testing::Test {
 protected:
  void listen(const std::vector<Preset>& presets) {
    DimseListener::Settings settings;
    settings.listen = "127.0.0.1:0";
    settings.presets = presets_by_title(presets);
    settings.log = [this](auto, const std::string& message) { log(message); };
    settings.log_warning = [this](auto, const std::string& message) { log("warning: " + message); };
    settings.log_error = settings.log_warning;
    settings.on_stranger = [this](const std::string& at) {
      ++strangers_;
      turned_away_by_ = at;
    };
    listener_.emplace(std::move(settings), inbox_);
  }
  static Preset preset(const std::string& aet, const std::vector<std::string>& callers,
                       const std::vector<std::string>& from) {
    return {.name = aet, .order = {}, .aet = aet, .callers = callers, .from = from};
  }
  /// What a peer hears that asks for an association and releases it when it has one.
  std::string answer() const {
    const std::string& address = listener_->address();
    const FileDescriptor peer(connect_to_loopback(std::stoi(address.substr(address.find(':') + 1))));
    const timeval patience{30, 0};
    ::setsockopt(peer.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    const std::string said = association_request() + release_request();
    ::send(peer.get(), said.data(), said.size(), MSG_NOSIGNAL);
    std::string heard;
    char buffer[4096];
    for (ssize_t got; (got = ::recv(peer.get(), buffer, sizeof buffer, 0)) > 0;)
      heard.append(buffer, static_cast<std::size_t>(got));
    return heard;
  }
  /// All that was logged; the listener has ended.
  std::string logged() {
    listener_.reset();
    return log_;
  }

  std::atomic<int> strangers_ = 0;
  std::string turned_away_by_;  ///< the last one; read when the listener has ended

 private:
  void log(const std::string& message) {
    const std::lock_guard lock(mutex_);
    log_ += message + "\n";
  }

  Inbox inbox_;
  std::mutex mutex_;
  std::string log_;
  std::optional<DimseListener> listener_;
};

/// An A-ASSOCIATE-RJ: permanent, by the service user, calling AE title not recognised (PS3.8, 9.3.4).
const std::string kNotRecognised("\3\0\0\0\0\4\0\1\1\3", 10);

TEST_F(DimseListening, CallersThatAPresetNamesAreTaken) {
  for (const auto& [callers, from] :
       std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>>{
           {{}, {}}, {{"CT1", "RAW"}, {}}, {{}, {"10.0.0.0/8", "127.0.0.1"}}, {{"RAW"}, {"127.0.0.0/8"}}}) {
    listen({preset("HEAD", callers, from), preset("FOOT", {"CT1"}, {"10.0.0.0/8"})});
    EXPECT_EQ(answer()[0], 2);  // A-ASSOCIATE-AC
    EXPECT_THAT(logged(), testing::Not(testing::HasSubstr("warning")));
  }
  EXPECT_EQ(strangers_, 0);
}

TEST_F(DimseListening, OthersAreRejectedCountedAndLogged) {
  int expected = 0;
  for (const auto& [callers, from] :
       std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>>{
           {{"CT1", "raw"}, {}},
           {{}, {"10.0.0.0/8", "127.0.0.2"}},
           {{"CT1"}, {"127.0.0.1"}},
           {{"RAW"}, {"126.0.0.0/8"}}}) {
    listen({preset("HEAD", callers, from), preset("FOOT", {"RAW"}, {"127.0.0.1"})});
    EXPECT_EQ(answer(), kNotRecognised);
    EXPECT_THAT(logged(),
                testing::HasSubstr("warning: from RAW to HEAD: 0 stored, 0 refused, rejected: RAW at "
                                   "127.0.0.1 may not call"));
    EXPECT_EQ(strangers_, ++expected);
    EXPECT_EQ(turned_away_by_, "HEAD");
  }
}

/// So DCMTK never sees what a stranger sends, and strangers take no places.
TEST_F(DimseListening, WhoComesFromWhereNobodyIsExpectedGetsNoProcess) {
  listen({preset("HEAD", {}, {"10.0.0.0/8"}), preset("FOOT", {"RAW"}, {"192.0.2.0/24"})});
  EXPECT_EQ(answer(), kNotRecognised);
  EXPECT_EQ(strangers_, 1);
  EXPECT_EQ(logged(), "warning: rejected: 127.0.0.1 may not call\n");
  EXPECT_EQ(turned_away_by_, "");
}

TEST_F(DimseListening, StrangersDoNotFillTheLog) {
  listen({preset("HEAD", {}, {"10.0.0.0/8"})});
  for (int k = 0; k < 70; ++k) EXPECT_EQ(answer(), kNotRecognised);
  EXPECT_EQ(strangers_, 70);
  EXPECT_EQ(std::ranges::count(logged(), '\n'), 60);
}

TEST_F(DimseListening, ATitleThatIsNoPresetsIsNoStrangersDoing) {
  listen({preset("FOOT", {"CT1"}, {})});
  EXPECT_EQ(answer(), std::string("\3\0\0\0\0\4\0\1\1\7", 10));
  EXPECT_EQ(strangers_, 0);
  EXPECT_EQ(logged(), "from RAW to HEAD: 0 stored, 0 refused, rejected\n");
}

}  // namespace
}  // namespace volsmooth
