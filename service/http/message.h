#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

#include "service/http/head_check.h"
#include "service/http/target.h"
#include "service/jobs/caller.h"
#include "service/jobs/job_service.h"

namespace volsmooth {

/// A request as the handlers see it: matched, its query checked, its body received.
struct Request {
  Head head;
  Caller caller;
  std::map<std::string, std::string, std::less<>> path;  ///< by the names in the route's pattern
  QueryValues query;
  std::string text;                  ///< a JSON body
  std::optional<IncomingFile> file;  ///< an uploaded body
  std::optional<std::string> idempotency_key = {};
  std::shared_ptr<void> key_claim = {};  ///< holds that key
};

/// A body that is at hand.
struct Document {
  std::string bytes;
  std::string media_type = "application/json";
};

/// A stretch of a file, with what comes before it (a part's head in multipart/byteranges).
struct FilePiece {
  std::string prefix;
  std::int64_t offset = 0;
  std::int64_t length = 0;
};

struct FileBody {
  std::shared_ptr<const CheckedFile> file;
  std::vector<FilePiece> pieces;
  std::string media_type;
};

/// Calls `wake` from any thread when there is news, until the returned handle is dropped.
using Subscribe = std::function<std::shared_ptr<void>(std::function<void()> wake)>;

/// Server-sent events, as they come.
struct EventStream {
  struct Batch {
    std::string text;  ///< in the format of text/event-stream; may be empty
    bool last = false;
  };
  Subscribe subscribe;
  std::function<tl::expected<Batch, Problem>()> next;  ///< blocks on the store
};

struct Response;
using Reply = tl::expected<Response, Problem>;

/// An answer worth waiting for: `ask` is called now and after every piece of news, until its answer is final
/// or the time is over.
struct LongPoll {
  struct Answer {
    std::string json;
    bool final = false;
  };
  Subscribe subscribe;
  std::chrono::milliseconds patience{};
  std::function<tl::expected<Answer, Problem>()> ask;  ///< blocks on the store
};

struct Response {
  int status = 200;
  std::vector<HeaderField> headers = {};
  std::variant<std::monostate, Document, FileBody, EventStream, LongPoll> body = {};
};

}  // namespace volsmooth
