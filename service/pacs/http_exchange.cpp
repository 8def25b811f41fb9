#include "service/pacs/http_exchange.h"

#include <curl/curl.h>

#include <exception>
#include <memory>
#include <stdexcept>

namespace volsmooth {
namespace {

constexpr long kConnectSeconds = 10;
constexpr long kStalledSeconds = 60;
constexpr std::size_t kMostDocument = std::size_t{16} << 20;

struct Transfer {
  const NodeRequest& request;
  CURL* easy;
  NodeAnswer answer;
  std::exception_ptr thrown;
  bool too_long = false;
};

/// Nothing may be thrown through libcurl.
template <class Body>
bool guarded(Transfer& transfer, const Body& body) {
  try {
    body();
    return true;
  } catch (...) {
    transfer.thrown = std::current_exception();
    return false;
  }
}

bool is_success(long status) {
  return status >= 200 && status < 300;
}

std::size_t on_body(char* data, std::size_t, std::size_t bytes, void* user) {
  auto& transfer = *static_cast<Transfer*>(user);
  long status = 0;
  curl_easy_getinfo(transfer.easy, CURLINFO_RESPONSE_CODE, &status);
  if (transfer.request.sink && is_success(status))
    return guarded(transfer, [&] { transfer.request.sink({data, bytes}); }) ? bytes : 0;
  transfer.too_long = transfer.answer.body.size() + bytes > kMostDocument;
  if (transfer.too_long) return 0;
  transfer.answer.body.append(data, bytes);
  return bytes;
}

int on_progress(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  auto& transfer = *static_cast<Transfer*>(user);
  return guarded(transfer, [&] { transfer.request.keep_going(); }) ? 0 : 1;
}

using Easy = std::unique_ptr<CURL, decltype(&curl_easy_cleanup)>;
using HeaderList = std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)>;

HeaderList header_list(const NodeRequest& request) {
  curl_slist* first = nullptr;
  const auto add = [&](const std::string& line) { first = curl_slist_append(first, line.c_str()); };
  for (const std::string& line : request.headers) add(line);
  add("Expect:");
  return {first, curl_slist_free_all};
}

void set_up(CURL* easy, const Node& node, Transfer& transfer, curl_slist* headers) {
  curl_easy_setopt(easy, CURLOPT_URL, (node.url + transfer.request.target).c_str());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy, CURLOPT_HTTP_VERSION, CURL_HTTP_VERSION_1_1);
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, kStalledSeconds);
  curl_easy_setopt(easy, CURLOPT_USERAGENT, "volsmooth/" VOLSMOOTH_VERSION);
  curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers);
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, on_body);
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, &transfer);
  curl_easy_setopt(easy, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(easy, CURLOPT_XFERINFOFUNCTION, on_progress);
  curl_easy_setopt(easy, CURLOPT_XFERINFODATA, &transfer);
  if (!node.login.empty()) {
    curl_easy_setopt(easy, CURLOPT_HTTPAUTH, CURLAUTH_BASIC);
    curl_easy_setopt(easy, CURLOPT_USERPWD, node.login.c_str());
  } else if (!node.token.empty()) {
    curl_easy_setopt(easy, CURLOPT_HTTPAUTH, CURLAUTH_BEARER);
    curl_easy_setopt(easy, CURLOPT_XOAUTH2_BEARER, node.token.c_str());
  }
  if (transfer.request.body) {
    curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE,
                     static_cast<curl_off_t>(transfer.request.body->size()));
    curl_easy_setopt(easy, CURLOPT_POSTFIELDS, transfer.request.body->data());
  }
}

}  // namespace

tl::expected<NodeAnswer, NodeFailure> exchange(const Node& node, const NodeRequest& request) {
  static const CURLcode ready = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (ready != CURLE_OK) throw std::runtime_error("libcurl cannot be initialised");
  const Easy easy(curl_easy_init(), curl_easy_cleanup);
  Transfer transfer{request, easy.get(), {}, {}};
  const HeaderList headers = header_list(request);
  set_up(easy.get(), node, transfer, headers.get());
  const CURLcode code = curl_easy_perform(easy.get());
  if (transfer.thrown) std::rethrow_exception(transfer.thrown);
  if (transfer.too_long)
    return tl::unexpected(NodeFailure{
        {"node-refused", "The node '" + node.name + "' gave an endless answer.", {{"node", node.name}}},
        false});
  if (code != CURLE_OK)
    return tl::unexpected(
        NodeFailure{{"node-unreachable",
                     "The node '" + node.name + "' cannot be reached: " + curl_easy_strerror(code) + ".",
                     {{"node", node.name}}},
                    true});
  curl_easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &transfer.answer.status);
  const char* type = nullptr;
  curl_easy_getinfo(easy.get(), CURLINFO_CONTENT_TYPE, &type);
  if (type) transfer.answer.content_type = type;
  return std::move(transfer.answer);
}

NodeFailure failure_of_status(const Node& node, long status) {
  constexpr long kRequestTimeout = 408, kTooManyRequests = 429, kFirstServerError = 500;
  const bool passing = status == kRequestTimeout || status == kTooManyRequests || status >= kFirstServerError;
  return {{passing ? "node-unreachable" : "node-refused",
           "The node '" + node.name + "' answered with status " + std::to_string(status) + ".",
           {{"node", node.name}, {"node_status", status}}},
          passing};
}

}  // namespace volsmooth
