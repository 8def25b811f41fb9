#include <chrono>
#include <span>

#include "service/http/audit_entry.h"
#include "service/http/entity_tag.h"
#include "service/http/problem_types.h"
#include "service/http/session.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kFileBlockBytes = BlockSums::kBlockBytes;  // each is read, checked and sent whole
constexpr int kRetrySeconds = 5;

/// What no browser is to make of an answer: it is data, of this site alone.
const std::vector<HeaderField> kSafety = {
    {"X-Content-Type-Options", "nosniff"},
    {"Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'; sandbox"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Referrer-Policy", "no-referrer"},
};

/// The fields that go with a problem beside its document.
std::vector<HeaderField> fields_for(const Problem& problem, int status) {
  std::vector<HeaderField> fields = {{"Cache-Control", "no-store"}};
  if (status == 401) fields.push_back({"WWW-Authenticate", R"(Bearer realm="volsmooth")"});
  if (problem.slug == "insufficient-scope")
    fields.push_back({"WWW-Authenticate", R"(Bearer realm="volsmooth", error="insufficient_scope", scope=")" +
                                              problem.members.value("scope", "") + '"'});
  if (status == 405) fields.push_back({"Allow", problem.members.value("allow", "")});
  if (status == 416)
    fields.push_back(
        {"Content-Range", "bytes */" + std::to_string(problem.members.value("bytes", std::int64_t{0}))});
  if (status == 429 || status == 503) fields.push_back({"Retry-After", std::to_string(kRetrySeconds)});
  return fields;
}

Response response_to(const Problem& problem) {
  const int status = problem_type(problem.slug).status;
  return {status, fields_for(problem, status),
          Document{problem_document(problem).dump(), "application/problem+json"}};
}

/// The length of the body, the type of it, or how it is framed.
void describe(const std::monostate&, int status, std::vector<HeaderField>& fields) {
  if (status != 204 && status != 304) fields.push_back({"Content-Length", "0"});
}

void describe(const Document& document, int, std::vector<HeaderField>& fields) {
  fields.push_back({"Content-Type", document.media_type});
  fields.push_back({"Content-Length", std::to_string(document.bytes.size())});
}

void describe(const FileBody& body, int, std::vector<HeaderField>& fields) {
  std::int64_t length = 0;
  for (const auto& piece : body.pieces)
    length += static_cast<std::int64_t>(piece.prefix.size()) + piece.length;
  fields.push_back({"Content-Type", body.media_type});
  fields.push_back({"Content-Length", std::to_string(length)});
}

void describe(const EventStream&, int, std::vector<HeaderField>& fields) {
  fields.push_back({"Content-Type", "text/event-stream"});
}

void describe(const LongPoll&, int, std::vector<HeaderField>&) {}

}  // namespace

Session::Awaitable<void> Session::send(Exchange& exchange, Reply reply) {
  if (reply && std::holds_alternative<LongPoll>(reply->body)) {
    LongPoll poll = std::move(std::get<LongPoll>(reply->body));
    reply = co_await wait_for(exchange, poll, std::move(*reply));
  }
  reply = co_await audited(exchange, std::move(reply));
  Response response = reply ? std::move(*reply) : response_to(reply.error());
  const Head& head = exchange.request.head;
  const auto stream = std::get_if<EventStream>(&response.body);
  if (stream && head.http_1_0) exchange.keep_alive = false;

  auto fields = std::move(response.headers);
  std::visit([&](const auto& body) { describe(body, response.status, fields); }, response.body);
  fields.push_back({"X-Request-Id", exchange.record.id});
  for (const HeaderField& field : kSafety) fields.push_back(field);
  if (context_.tls) fields.push_back({"Strict-Transport-Security", "max-age=31536000"});
  if (stream && !head.http_1_0) fields.push_back({"Transfer-Encoding", "chunked"});
  if (!exchange.keep_alive) fields.push_back({"Connection", "close"});

  exchange.record.status = response.status;
  std::string text = response_head(response.status, fields);
  const bool with_body = head.method != "HEAD";
  const auto document = std::get_if<Document>(&response.body);
  if (document && with_body) text += document->bytes;
  bool sent = co_await write(exchange, text);
  const auto file = std::get_if<FileBody>(&response.body);
  if (sent && with_body && file) sent = co_await send_file(exchange, *file);
  if (sent && with_body && stream) sent = co_await send_events(exchange, *stream);
  if (!sent) exchange.keep_alive = false;
}

/// Audits what leaves no row of its own: bytes of files that go out, and what was refused. Bytes that cannot
/// be audited stay here; a refusal stands.
Session::Awaitable<Reply> Session::audited(Exchange& exchange, Reply reply) {
  auto entry = audit_entry(exchange.route, exchange.request, reply);
  if (!entry) co_return reply;
  const bool is_known = !exchange.request.caller.token.empty();
  if (!is_known && (entry->outcome == "unauthenticated" || entry->outcome == "cross-origin")) {
    const auto others = context_.unknown_callers.admit();
    if (!others) co_return reply;
    entry->outcome += *others;
  }
  const auto recorded =
      co_await run_guarded(context_.auditing, exchange, [&]() -> tl::expected<void, Problem> {
        const ActingFor caller(actor_of(exchange));
        context_.api.jobs.audit_done(*entry);
        return {};
      });
  if (!recorded && reply) reply = tl::unexpected(recorded.error());
  co_return reply;
}

Session::Awaitable<bool> Session::send_file(Exchange& exchange, const FileBody& body) {
  std::vector<char> block;
  for (const auto& piece : body.pieces) {
    if (!co_await write(exchange, piece.prefix)) co_return false;
    const std::int64_t end = piece.offset + piece.length;
    for (std::int64_t at = piece.offset; at < end; at += static_cast<std::int64_t>(block.size())) {
      const auto read = co_await run_guarded(context_.bulk, exchange, [&]() -> tl::expected<void, Problem> {
        block.resize(static_cast<std::size_t>(std::min(kFileBlockBytes - at % kFileBlockBytes, end - at)));
        body.file->read(at, std::as_writable_bytes(std::span(block)));
        return {};
      });
      if (!read || !check_current(exchange)) co_return false;
      if (!co_await write(exchange, {block.data(), block.size()})) co_return false;
    }
  }
  co_return true;
}

Session::Awaitable<bool> Session::send_events(Exchange& exchange, EventStream& stream) {
  wake_ = std::make_shared<Wake>(connection_.executor());
  const auto subscription = stream.subscribe(wake_->waker());
  connection_.on_readable(wake_->waker());
  const auto framed = [&](std::string_view text) {
    return exchange.request.head.http_1_0 ? std::string(text) : as_chunk(text);
  };

  bool connected = true;
  for (bool last = false; connected && !last && !context_.stopping;) {
    auto batch = co_await run_guarded(context_.reading, exchange, [&] { return stream.next(); });
    if (!batch || !check_current(exchange)) break;  // the job is gone, and with it what there was to say
    last = batch->last;
    if (!batch->text.empty()) connected = co_await write(exchange, framed(batch->text));
    if (last || !connected) break;
    const auto now = std::chrono::steady_clock::now();
    const auto silence = std::chrono::milliseconds(
        static_cast<std::int64_t>(1000 * context_.settings.keep_alive_comment_seconds));
    co_await wake_->sleep_until(now + silence);
    if (std::chrono::steady_clock::now() >= now + silence)
      connected = co_await write(exchange, framed(": alive\n\n"));
    connected = connected && !connection_.peer_has_closed();
  }
  connection_.cancel();
  wake_.reset();
  if (connected && !exchange.request.head.http_1_0) connected = co_await write(exchange, as_chunk({}));
  co_return connected;
}

Session::Awaitable<Reply> Session::wait_for(Exchange& exchange, LongPoll& poll, Response head) {
  wake_ = std::make_shared<Wake>(connection_.executor());
  const auto subscription = poll.subscribe(wake_->waker());
  connection_.on_readable(wake_->waker());
  const auto end = std::chrono::steady_clock::now() + poll.patience;

  Reply reply = std::move(head);
  for (bool waiting = true; waiting;) {
    auto answer = co_await run_guarded(context_.reading, exchange, [&] { return poll.ask(); });
    if (!answer) {
      reply = tl::unexpected(answer.error());
      break;
    }
    reply->body = Document{answer->json};
    waiting = !answer->final && !context_.stopping && std::chrono::steady_clock::now() < end &&
              !connection_.peer_has_closed();
    if (waiting) co_await wake_->sleep_until(end);
    if (const auto current = check_current(exchange); !current) {
      reply = tl::unexpected(current.error());
      break;
    }
  }
  if (reply) reply->headers.push_back({"ETag", entity_tag(std::get<Document>(reply->body).bytes)});
  connection_.cancel();
  wake_.reset();
  co_return reply;
}

Session::Awaitable<bool> Session::write(Exchange& exchange, std::string_view bytes) {
  exchange.record.bytes_out += static_cast<std::int64_t>(bytes.size());
  writing_ = true;
  const bool written = co_await connection_.write(bytes, context_.settings.write_seconds);
  writing_ = false;
  co_return written;
}

}  // namespace volsmooth
