#include "client/http.h"

#include <curl/curl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <random>
#include <thread>

namespace volsmooth {
namespace {

constexpr long kConnectSeconds = 10;
constexpr long kStalled =
    300;  ///< seconds without a byte; verifying a large upload takes a good part of a minute
constexpr long kBufferBytes = 1L << 18;
constexpr std::chrono::milliseconds kPause{500};  ///< before the second try; before the third, twice that
constexpr std::size_t kMaxDocument = std::size_t{64} << 20;  ///< bytes; documents are kept in memory

/// What the callbacks of one transfer share.
struct Transfer {
  const Request& request;
  CURL* easy;
  Response response;
  std::optional<Failure> failure;
  std::int64_t sent = 0;
};

std::size_t on_body(char* data, std::size_t, std::size_t bytes, void* user) {
  auto& transfer = *static_cast<Transfer*>(user);
  long status = 0;
  curl_easy_getinfo(transfer.easy, CURLINFO_RESPONSE_CODE, &status);
  if (transfer.request.sink && status >= 200 && status < 300) {
    const auto taken = transfer.request.sink({data, bytes});
    if (!taken) transfer.failure = taken.error();
    return taken ? bytes : 0;
  }
  if (transfer.response.body.size() + bytes > kMaxDocument) {
    transfer.failure = Failure{ExitCode::kInternal, "The server's answer is too long for a document.", {}};
    return 0;
  }
  transfer.response.body.append(data, bytes);
  return bytes;
}

std::size_t on_read(char* data, std::size_t, std::size_t bytes, void* user) {
  auto& transfer = *static_cast<Transfer*>(user);
  const FileBody& file = *transfer.request.file;
  const auto left = static_cast<std::size_t>(file.bytes - transfer.sent);
  const ssize_t got = read(file.descriptor, data, std::min(bytes, left));
  if (got < 0 || (got == 0 && left > 0)) {
    const std::string why = got < 0 ? std::strerror(errno) : "it became shorter";
    transfer.failure = Failure{ExitCode::kNoInput, "The file cannot be read to its end: " + why + ".", {}};
    return CURL_READFUNC_ABORT;
  }
  transfer.sent += got;
  file.on_sent(transfer.sent);
  return static_cast<std::size_t>(got);
}

/// The sentence for a transfer that gave no whole answer.
Failure broken(CURLcode code, const ServerAddress& server) {
  switch (code) {
    case CURLE_COULDNT_CONNECT:
    case CURLE_COULDNT_RESOLVE_HOST:
      return {ExitCode::kUnreachable,
              "No server answers at " + server.as_written + "; is volsmoothd running there?",
              {}};
    case CURLE_OPERATION_TIMEDOUT:
      return {ExitCode::kUnreachable, "The server at " + server.as_written + " did not answer in time.", {}};
    case CURLE_PEER_FAILED_VERIFICATION:
      return {ExitCode::kUnreachable,
              "The certificate of the server at " + server.as_written +
                  " is not trusted, or is of another name; --ca-file names whom to trust.",
              {}};
    case CURLE_SSL_CACERT_BADFILE:
      return {ExitCode::kNoInput, "No certificates can be read from " + server.ca_file + ".", {}};
    default:
      return {ExitCode::kUnreachable,
              "The connection to " + server.as_written + " broke: " + curl_easy_strerror(code) + ".",
              {}};
  }
}

/// The connection was there and broke, or nothing came over it for too long.
bool is_answer_lost(CURLcode code, CURL* easy) {
  long sent = 0;
  curl_easy_getinfo(easy, CURLINFO_REQUEST_SIZE, &sent);
  return code == CURLE_GOT_NOTHING || code == CURLE_RECV_ERROR || code == CURLE_SEND_ERROR ||
         code == CURLE_PARTIAL_FILE || (code == CURLE_OPERATION_TIMEDOUT && sent > 0);
}

const Failure kInterruptedFailure{ExitCode::kInterrupted, "Interrupted.", {}};

struct HeaderList {
  curl_slist* first = nullptr;
  ~HeaderList() { curl_slist_free_all(first); }
  void add(const std::string& line) { first = curl_slist_append(first, line.c_str()); }
};

}  // namespace

std::string new_idempotency_key() {
  std::random_device random;  // the kernel's
  std::string key;
  for (int word = 0; word < 4; ++word) key += std::to_string(random()) + (word < 3 ? "-" : "");
  return key;
}

struct HttpClient::Handles {
  CURL* easy = curl_easy_init();
  CURLM* multi = curl_multi_init();  ///< holds the connections; lets an interruption end a wait at once

  Handles() = default;
  Handles(const Handles&) = delete;
  ~Handles() {
    curl_easy_cleanup(easy);
    curl_multi_cleanup(multi);
  }

  void set_up(const ServerAddress& server, Transfer& transfer, const HeaderList& headers) const {
    const Request& request = transfer.request;
    curl_easy_reset(easy);
    curl_easy_setopt(easy, CURLOPT_URL, (server.url + request.target).c_str());
    if (!server.socket_path.empty())
      curl_easy_setopt(easy, CURLOPT_UNIX_SOCKET_PATH, server.socket_path.c_str());
    if (server.is_local()) curl_easy_setopt(easy, CURLOPT_PROXY, "");
    if (!server.ca_file.empty()) curl_easy_setopt(easy, CURLOPT_CAINFO, server.ca_file.c_str());
    if (!server.ca_file.empty())
      curl_easy_setopt(easy, CURLOPT_CAPATH, nullptr);  // the system's would count as well
    curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(easy, CURLOPT_PATH_AS_IS, 1L);
    curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, kStalled);
    curl_easy_setopt(easy, CURLOPT_TIMEOUT, static_cast<long>(request.timeout.count()));
    curl_easy_setopt(easy, CURLOPT_USERAGENT, "volsmooth/" VOLSMOOTH_VERSION);
    curl_easy_setopt(easy, CURLOPT_BUFFERSIZE, kBufferBytes);
    curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, on_body);
    curl_easy_setopt(easy, CURLOPT_WRITEDATA, &transfer);
    set_body(transfer);
    curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request.method.c_str());
    curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers.first);
  }

  void set_body(Transfer& transfer) const {
    const Request& request = transfer.request;
    if (request.file != nullptr) {
      curl_easy_setopt(easy, CURLOPT_POST, 1L);
      curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.file->bytes));
      curl_easy_setopt(easy, CURLOPT_UPLOAD_BUFFERSIZE, kBufferBytes);
      curl_easy_setopt(easy, CURLOPT_READFUNCTION, on_read);
      curl_easy_setopt(easy, CURLOPT_READDATA, &transfer);
    } else if (request.method == "POST") {
      curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body.size()));
      curl_easy_setopt(easy, CURLOPT_POSTFIELDS, request.body.c_str());
    }
  }

  /// The transfer's end, or none when it was interrupted.
  std::optional<CURLcode> perform(const Interruption* interruption) const {
    curl_multi_add_handle(multi, easy);
    std::optional<CURLcode> end;
    for (int running = 1; !end && !(interruption != nullptr && interruption->happened());) {
      curl_multi_perform(multi, &running);
      int queued = 0;
      if (const CURLMsg* message = curl_multi_info_read(multi, &queued)) {
        end = message->data.result;
      } else {
        curl_waitfd extra{interruption != nullptr ? interruption->descriptor() : 0, CURL_WAIT_POLLIN, 0};
        curl_multi_poll(multi, &extra, interruption != nullptr ? 1 : 0, 1000, nullptr);
      }
    }
    curl_multi_remove_handle(multi, easy);
    return end;
  }
};

HttpClient::HttpClient(ServerAddress server, std::string token, const Interruption& interruption, Log log)
    : server_(std::move(server)),
      token_(std::move(token)),
      interruption_(interruption),
      log_(std::move(log)) {
  static const CURLcode ready = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (ready != CURLE_OK) throw std::runtime_error("libcurl cannot be initialised");
  handles_ = std::make_unique<Handles>();
}

HttpClient::~HttpClient() = default;

Expected<Response> HttpClient::send(const Request& request) {
  const off_t start = request.file != nullptr ? lseek(request.file->descriptor, 0, SEEK_CUR) : 0;
  Outcome outcome = send_once(request);
  for (int tries = 1; tries < kTries && is_worth_another(request, outcome, tries > 1); ++tries) {
    if (request.interruptible && interruption_.waited(tries * kPause)) break;
    if (!request.interruptible) std::this_thread::sleep_for(tries * kPause);
    if (request.file != nullptr && lseek(request.file->descriptor, start, SEEK_SET) < 0) break;
    outcome = send_once(request);
  }
  return std::move(outcome.response);
}

/// A server that is not there at first is not there; one that went away may be back in a moment, and needs
/// one to see that the connection is broken.
bool HttpClient::is_worth_another(const Request& request, const Outcome& outcome, bool is_repetition) const {
  if (request.idempotency_key.empty()) return false;
  if (outcome.is_lost) return true;
  if (!is_repetition) return false;
  if (!outcome.response) return outcome.response.error().code == ExitCode::kUnreachable;
  return outcome.response->status == 409 &&
         outcome.response->body.find("/problems/idempotency-in-flight") != std::string::npos;
}

HttpClient::Outcome HttpClient::send_once(const Request& request) {
  Transfer transfer{request, handles_->easy, {}, {}};
  HeaderList headers;
  headers.add("Accept: application/json, application/problem+json, */*");
  headers.add("Content-Type:" + (request.content_type.empty() ? "" : " " + request.content_type));
  if (!request.idempotency_key.empty()) headers.add("Idempotency-Key: " + request.idempotency_key);
  if (!token_.empty()) headers.add("Authorization: Bearer " + token_);
  handles_->set_up(server_, transfer, headers);

  const auto end = handles_->perform(request.interruptible ? &interruption_ : nullptr);
  curl_easy_getinfo(handles_->easy, CURLINFO_RESPONSE_CODE, &transfer.response.status);
  if (log_) log_(request.method + " " + request.target + " " + std::to_string(transfer.response.status));
  if (!end) return {tl::unexpected(kInterruptedFailure)};
  if (transfer.failure) return {tl::unexpected(*transfer.failure)};
  if (*end != CURLE_OK) return {tl::unexpected(broken(*end, server_)), is_answer_lost(*end, handles_->easy)};

  const char* content_type = nullptr;
  curl_easy_getinfo(handles_->easy, CURLINFO_CONTENT_TYPE, &content_type);
  if (content_type != nullptr) transfer.response.content_type = content_type;
  return {std::move(transfer.response)};
}

}  // namespace volsmooth
