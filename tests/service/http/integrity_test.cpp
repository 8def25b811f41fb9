// Rot in stored files: what is given out is what was stored, or it ends.

#include <cstdlib>
#include <random>

#include "service/storage/block_sums.h"
#include "tests/service/http/running_server.h"
#include "tests/support/bit_flip.h"

namespace volsmooth {
namespace {

constexpr std::size_t kBlock = BlockSums::kBlockBytes;
constexpr std::size_t kBytes = 5 * kBlock + 12'345;

/// The long form: VOLSMOOTH_BIT_FLIPS=1000.
int flips() {
  const char* const wanted = std::getenv("VOLSMOOTH_BIT_FLIPS");
  return wanted ? std::atoi(wanted) : 40;
}

class IntegrityTest : public ServerTest {
 protected:
  IntegrityTest() {
    for (char& byte : bytes_) byte = static_cast<char>(random_());
  }

  /// As much of an answer's body as comes before the connection ends; its status first.
  std::pair<int, std::string> ask_raw(const std::string& path, const std::string& fields = "") {
    HttpClient client = connect();
    client.send(request("GET " + path, "", fields + "Connection: close\r\n"));
    std::string all = client.receive_to_end();
    const auto body = all.find("\r\n\r\n");
    if (body == std::string::npos) return {0, ""};
    return {std::stoi(all.substr(9, 3)), all.substr(body + 4)};
  }

  /// The first and the last byte of one: around that byte, or just the first of its block.
  std::pair<std::size_t, std::size_t> stretch_that_needs(std::size_t byte) {
    const std::size_t start = byte / kBlock * kBlock;
    if (random_() % 4 == 0) return {start, start};
    return {byte - std::min(byte, random_() % (2 * kBlock)),
            std::min(kBytes - 1, byte + random_() % (2 * kBlock))};
  }

  std::mt19937_64 random_{2024};
  std::string bytes_ = std::string(kBytes, '\0');
};

/// Each flip is found by the download of the whole, or by a range that needs its block; nothing wrong is
/// sent.
TEST_F(IntegrityTest, EveryFlippedBitIsFoundAndNoWrongByteIsSent) {
  int found = 0, sent_wrong = 0;
  for (int flip = 0; flip < flips(); ++flip) {
    const std::string volume = upload(bytes_);
    const std::string job = flip % 8 == 0 ? finished_job(volume) : "";
    const std::string url =
        job.empty() ? "/v1/volumes/" + volume + "/content" : "/v1/jobs/" + job + "/results/out.nii.gz";
    const auto bit = random_() % (8 * kBytes);
    flip_bit((job.empty() ? jobs_.volume_content(kAnyone, volume)
                          : jobs_.result(Caller::anyone(), job, "out.nii.gz"))
                 ->path,
             bit);

    const auto [first, last] =
        flip % 2 == 0 ? std::pair(std::size_t{0}, kBytes - 1) : stretch_that_needs(bit / 8);
    const std::string range = "Range: bytes=" + std::to_string(first) + "-" + std::to_string(last) + "\r\n";
    const auto [status, body] = ask_raw(url, flip % 2 == 0 ? "" : range);
    const std::string wanted = bytes_.substr(first, last - first + 1);
    sent_wrong += status == 500 ? body.find("integrity-failure") == std::string::npos
                                : !wanted.starts_with(body) || body.size() == wanted.size();
    found += jobs_.statistics().damaged_files == 1;
    EXPECT_EQ(ask_raw(url).first, 500);  // from now on
    if (!job.empty()) ask("DELETE /v1/jobs/" + job);
    ask("DELETE /v1/volumes/" + volume);
    EXPECT_EQ(jobs_.statistics().damaged_files, 0);
  }
  EXPECT_EQ(found, flips());
  EXPECT_EQ(sent_wrong, 0);
}

TEST_F(IntegrityTest, DamageInWhatIsSentFirstIsAProblemAndLaterEndsTheConnection) {
  const std::string volume = upload(bytes_), url = "/v1/volumes/" + volume + "/content";
  flip_bit(jobs_.volume_content(kAnyone, volume)->path, 8 * (kBytes - 1));
  const auto [status, body] = ask_raw(url);
  EXPECT_EQ(status, 200);
  EXPECT_TRUE(body == bytes_.substr(0, 5 * kBlock));
  EXPECT_EQ(slug(ask("GET " + url)), "integrity-failure");
}

TEST_F(IntegrityTest, TheMetricsCountDamagedFiles) {
  const std::string volume = upload(bytes_);
  flip_bit(jobs_.volume_content(kAnyone, volume)->path, 5);
  EXPECT_THAT(ask("GET /metrics").body, testing::HasSubstr("volsmooth_damaged_files 0"));
  EXPECT_EQ(slug(ask("GET /v1/volumes/" + volume + "/content")), "integrity-failure");
  EXPECT_THAT(ask("GET /metrics").body, testing::HasSubstr("volsmooth_damaged_files 1"));
}

}  // namespace
}  // namespace volsmooth
