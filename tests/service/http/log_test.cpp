#include "service/http/log.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

namespace volsmooth {
namespace {

TEST(Log, EveryLineIsAJsonObjectThatSaysWhenHowGraveAndWhat) {
  testing::internal::CaptureStderr();
  const auto before = spdlog::default_logger();
  start_log("debug");
  log_request({"7", "GET", "/v1/jobs/{id}", 200, 0, 12, 0.5});
  log_fault("7", "/v1/jobs", "no \"such\" thing\n\xFF");
  log_job(Job());
  log_event("ready", "listening");
  log_warning("odd", "look");
  log_error("broken", "help");
  const std::vector<std::string> plain = {"job j-1 attempt 2: it said \"no\"", "two\nlines\t\\", "", "\xFF"};
  for (const std::string& text : plain) spdlog::error(text);
  spdlog::set_default_logger(before);

  std::istringstream log(testing::internal::GetCapturedStderr());
  std::vector<std::string> messages;
  std::map<std::string, std::string> levels;
  for (std::string line; std::getline(log, line);) {
    const auto document = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(document.is_object()) << line;
    for (const char* member : {"time", "level", "event"}) EXPECT_TRUE(document.contains(member)) << line;
    levels[document["event"]] = document["level"];
    if (document["event"] == "message") messages.push_back(document["message"]);
  }
  EXPECT_EQ(messages, (std::vector<std::string>{plain[0], plain[1], "", "\uFFFD"}));
  EXPECT_EQ(levels, (std::map<std::string, std::string>{{"request", "info"},
                                                        {"fault", "error"},
                                                        {"job", "info"},
                                                        {"ready", "info"},
                                                        {"odd", "warning"},
                                                        {"broken", "error"},
                                                        {"message", "error"}}));
}

}  // namespace
}  // namespace volsmooth
