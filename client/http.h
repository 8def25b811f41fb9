#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "client/failure.h"
#include "client/interruption.h"
#include "client/server_address.h"

namespace volsmooth {

/// A file that is sent as the body, streamed from the descriptor's position on.
struct FileBody {
  int descriptor = -1;
  std::int64_t bytes = 0;
  std::function<void(std::int64_t sent)> on_sent = [](std::int64_t) {};
};

struct Request {
  std::string method = "GET";
  std::string target;  ///< path and query, percent-encoded
  std::string content_type = {};
  std::string body = {};
  const FileBody* file = nullptr;  ///< instead of `body`
  /// Gets the body of a success piece by piece; a failure it returns ends the transfer. Empty: see
  /// `Response::body`.
  std::function<Expected<void>(std::string_view)> sink = {};
  /// Lets the server tell a repetition from a new request. With one, a request whose answer got lost is sent
  /// again, up to `kTries` times in all.
  std::string idempotency_key = {};
  bool interruptible = true;
  std::chrono::seconds timeout{0};  ///< for all of it; 0: none, but see `kStalled` in http.cpp
};

struct Response {
  long status = 0;
  std::string content_type;
  std::string body;
};

/// A key that no other request has.
std::string new_idempotency_key();

/// One server, spoken to over connections that are kept. An answer of any status is a response; only no
/// answer, a broken one, or an interruption is a failure.
class HttpClient {
 public:
  using Log = std::function<void(const std::string& line)>;

  /// `token` goes along as a bearer token when it is not empty; `log` gets a line per request.
  HttpClient(ServerAddress server, std::string token, const Interruption& interruption, Log log = {});
  ~HttpClient();

  static constexpr int kTries = 4;
  Expected<Response> send(const Request& request);
  const ServerAddress& server() const { return server_; }

 private:
  struct Handles;
  /// Whether it is unknown what became of a request.
  struct Outcome {
    Expected<Response> response;
    bool is_lost = false;
  };
  Outcome send_once(const Request& request);
  bool is_worth_another(const Request& request, const Outcome& outcome, bool is_repetition) const;

  ServerAddress server_;
  std::string token_;
  const Interruption& interruption_;
  Log log_;
  std::unique_ptr<Handles> handles_;
};

}  // namespace volsmooth
