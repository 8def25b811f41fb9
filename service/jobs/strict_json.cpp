#include "service/jobs/strict_json.h"

#include <set>
#include <string>
#include <vector>

namespace volsmooth {
namespace {

using nlohmann::json;

constexpr std::size_t kMostBytes = std::size_t{1} << 20;
constexpr std::size_t kMostLevels = 16;

/// Walks a document without building it and stops at the first thing that is not allowed.
class StrictReader : public nlohmann::json_sax<json> {
 public:
  std::string problem;  // empty: none

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }

  bool start_object(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }

  bool key(string_t& name) override {
    return names_.back().insert(name).second || stop("an object holds the same name twice");
  }

  bool parse_error(std::size_t position, const std::string&, const json::exception& error) override {
    constexpr int kNumberOutOfRange = 406;
    const std::string where = " (near byte " + std::to_string(position) + ")";
    return stop(
        (error.id == kNumberOutOfRange ? "a number is too large for a double" : "not valid JSON in UTF-8") +
        where);
  }

 private:
  bool enter() {
    names_.emplace_back();
    return names_.size() <= kMostLevels ||
           stop("nested deeper than " + std::to_string(kMostLevels) + " levels");
  }
  bool leave() {
    names_.pop_back();
    return true;
  }
  bool stop(std::string why) {
    problem = std::move(why);
    return false;
  }

  std::vector<std::set<std::string>> names_;  // of each open level
};

tl::unexpected<Problem> refuse(std::string why) {
  return tl::unexpected(Problem{"bad-json", "The body is refused: " + std::move(why) + "."});
}

}  // namespace

tl::expected<json, Problem> parse_json(std::string_view text) {
  if (text.size() > kMostBytes) return refuse("longer than " + std::to_string(kMostBytes) + " bytes");
  // The parser would skip a byte order mark and take a NUL for the end.
  if (text.starts_with("\xEF\xBB\xBF")) return refuse("it begins with a byte order mark");
  if (text.find('\0') != std::string_view::npos) return refuse("it holds a NUL byte");
  StrictReader reader;
  if (!json::sax_parse(text, &reader)) return refuse(reader.problem);
  return json::parse(text);
}

}  // namespace volsmooth
