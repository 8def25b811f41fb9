#include "service/pacs/retrieval.h"

#include <algorithm>
#include <span>

#include "service/pacs/part_counter.h"

namespace volsmooth {
namespace {

using nlohmann::json;

constexpr long kNoContent = 204, kNotFound = 404;

tl::unexpected<NodeFailure> failed(std::string slug, std::string detail, bool passing,
                                   json members = json::object()) {
  return tl::unexpected(NodeFailure{{std::move(slug), std::move(detail), std::move(members)}, passing});
}

tl::unexpected<NodeFailure> not_there(const Node& node) {
  return failed("source-not-found", "The node '" + node.name + "' has no such series.", false,
                {{"node", node.name}});
}

/// How many instances the node lists of the series.
tl::expected<int, NodeFailure> listed_instances(const Node& node, const std::string& series) {
  const auto answer = exchange(node, {series + "/instances", {"Accept: application/dicom+json"}});
  if (!answer) return tl::unexpected(answer.error());
  if (answer->status == kNoContent || answer->status == kNotFound) return not_there(node);
  if (answer->status != kOk) return tl::unexpected(failure_of_status(node, answer->status));
  const auto list = json::parse(answer->body, nullptr, false);
  if (!list.is_array())
    return failed("node-refused", "The node '" + node.name + "' gave no list of the series' instances.",
                  false, {{"node", node.name}});
  if (list.empty()) return not_there(node);
  return static_cast<int>(list.size());
}

/// What comes is no multipart body.
struct NoMultipart {};

/// The boundary that a multipart body begins with, its first delimiter line being known.
class BoundaryFinder {
 public:
  /// Nothing until the first line is there. Throws NoMultipart when it does not come.
  std::optional<std::string> see(std::string_view bytes) {
    constexpr std::size_t kLongestStart = std::size_t{64} << 10;
    if (start_.size() > kLongestStart) throw NoMultipart();
    start_ += bytes;
    const std::size_t begin = start_.find("--");
    if (begin == std::string::npos) return std::nullopt;
    const std::size_t end = start_.find("\r\n", begin);
    if (end == std::string::npos) return std::nullopt;
    return start_.substr(begin + 2, end - begin - 2);
  }
  const std::string& seen() const { return start_; }

 private:
  std::string start_;
};

}  // namespace

tl::expected<void, NodeFailure> retrieve_series(const Node& node, const DicomSource& source,
                                                IncomingFile& file, std::int64_t max_bytes,
                                                const Progress& report) {
  const std::string series = "/studies/" + source.study + "/series/" + source.series;
  const auto listed = listed_instances(node, series);
  if (!listed) return tl::unexpected(listed.error());

  BoundaryFinder finder;
  std::optional<PartCounter> counter;
  bool too_large = false, no_multipart = false;
  NodeRequest request{series, {"Accept: multipart/related; type=\"application/dicom\"; transfer-syntax=*"}};
  const auto fraction = [&] {
    return counter ? std::min(1.0, static_cast<double>(counter->parts()) / *listed) : 0.0;
  };
  request.keep_going = [&] { report(fraction()); };
  struct TooLarge {};
  request.sink = [&](std::string_view bytes) {
    if (file.bytes() + std::ssize(bytes) > max_bytes) throw TooLarge();
    file.write(std::as_bytes(std::span(bytes)));
    if (counter) return counter->see(bytes);
    if (const auto boundary = finder.see(bytes)) {
      counter.emplace(*boundary);
      counter->see(finder.seen());
    }
  };
  tl::expected<NodeAnswer, NodeFailure> answer;
  try {
    answer = exchange(node, request);
  } catch (const TooLarge&) {
    too_large = true;
  } catch (const NoMultipart&) {
    no_multipart = true;
  }
  if (too_large)
    return failed("content-too-large", "The series is larger than an upload may be.", false,
                  {{"limit_bytes", max_bytes}});
  if (no_multipart)
    return failed("node-refused", "The node '" + node.name + "' gave no multipart/related body.", false,
                  {{"node", node.name}});
  if (!answer) return tl::unexpected(answer.error());
  if (answer->status == kNoContent || answer->status == kNotFound) return not_there(node);
  if (answer->status != kOk) return tl::unexpected(failure_of_status(node, answer->status));
  const int came = counter ? counter->parts() : 0;
  if (came < *listed)
    return failed("series-incomplete",
                  "The node '" + node.name + "' lists more instances of the series than it gave.", true,
                  {{"node", node.name}, {"listed", *listed}, {"came", came}});
  return {};
}

}  // namespace volsmooth
