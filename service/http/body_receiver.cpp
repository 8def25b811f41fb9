#include "service/http/body_receiver.h"

#include <algorithm>
#include <array>
#include <span>

#include "service/http/ascii.h"
#include "service/http/multipart.h"

namespace volsmooth {
namespace {

/// What a route without a body puts up with.
constexpr std::int64_t kMaxIgnoredBytes = 65536;

tl::unexpected<Problem> too_large(std::int64_t limit) {
  return tl::unexpected(Problem{"content-too-large",
                                "The body may have " + std::to_string(limit) + " bytes.",
                                {{"limit_bytes", limit}}});
}

tl::unexpected<Problem> unsupported(std::string_view detail) {
  return tl::unexpected(Problem{"unsupported-media-type", std::string(detail)});
}

tl::expected<void, Problem> append(std::string& text, std::string_view bytes) {
  if (text.size() + bytes.size() > static_cast<std::size_t>(kMaxTextBytes)) return too_large(kMaxTextBytes);
  text += bytes;
  return {};
}

tl::expected<void, Problem> append(IncomingFile& file, std::string_view bytes, std::int64_t limit) {
  if (file.bytes() + static_cast<std::int64_t>(bytes.size()) > limit) return too_large(limit);
  file.write(std::as_bytes(std::span(bytes)));
  return {};
}

class IgnoredBody : public BodyReceiver {
 public:
  tl::expected<void, Problem> receive(std::string_view bytes) override {
    received_ += static_cast<std::int64_t>(bytes.size());
    if (received_ > kMaxIgnoredBytes) return too_large(kMaxIgnoredBytes);
    return {};
  }

 private:
  std::int64_t received_ = 0;
};

class TextBody : public BodyReceiver {
 public:
  explicit TextBody(Request& request) : request_(request) {}
  tl::expected<void, Problem> receive(std::string_view bytes) override {
    return append(request_.text, bytes);
  }

 private:
  Request& request_;
};

class WholeFileBody : public BodyReceiver {
 public:
  WholeFileBody(Request& request, std::int64_t limit) : request_(request), limit_(limit) {}
  tl::expected<void, Problem> receive(std::string_view bytes) override {
    return append(*request_.file, bytes, limit_);
  }

 private:
  Request& request_;
  std::int64_t limit_;
};

/// A multipart form with the parts `volume` and, where the route takes an order, `job`.
class FormBody : public BodyReceiver {
 public:
  FormBody(std::string_view boundary, bool with_job, Request& request, std::int64_t limit)
      : request_(request),
        limit_(limit),
        with_job_(with_job),
        reader_(boundary, {[this](std::string_view name) { return begin(name); },
                           [this](std::string_view bytes) { return take(bytes); }}) {}

  tl::expected<void, Problem> receive(std::string_view bytes) override { return reader_.read(bytes); }

  tl::expected<void, Problem> finish() override {
    if (auto ended = reader_.finish(); !ended) return ended;
    if (!volume_seen_ || job_seen_ != with_job_) return wrong_parts();
    return {};
  }

 private:
  tl::unexpected<Problem> wrong_parts() const {
    return tl::unexpected(
        Problem{"bad-multipart", with_job_ ? "The form must have the parts volume and job, once each."
                                           : "The form must have the part volume, once."});
  }

  tl::expected<void, Problem> begin(std::string_view name) {
    in_volume_ = name == "volume";
    bool& seen = in_volume_ ? volume_seen_ : job_seen_;
    const bool known = in_volume_ || (with_job_ && name == "job");
    if (!known || seen) return wrong_parts();
    seen = true;
    return {};
  }

  tl::expected<void, Problem> take(std::string_view bytes) {
    return in_volume_ ? append(*request_.file, bytes, limit_) : append(request_.text, bytes);
  }

  Request& request_;
  std::int64_t limit_;
  bool with_job_;
  bool in_volume_ = false, volume_seen_ = false, job_seen_ = false;
  MultipartReader reader_;
};

constexpr std::array kJsonTypes = {BodyType{"application/json", BodyForm::kText}};
/// DICOM files as STOW-RS sends them, in multipart/related (PS3.18, section 8.6), are kept whole, and read
/// like any file.
constexpr std::array kFileTypes = {BodyType{"application/octet-stream", BodyForm::kWhole},
                                   BodyType{"multipart/related", BodyForm::kWhole},
                                   BodyType{"multipart/form-data", BodyForm::kParts}};
constexpr std::array kOrderTypes = {BodyType{"application/json", BodyForm::kText},
                                    BodyType{"multipart/form-data", BodyForm::kParts}};

/// None: the kind does not take such a body.
std::optional<BodyForm> form_of(BodyKind kind, std::string_view content_type) {
  const auto media_type = lowered(split(content_type, ';').front());
  const auto types = body_types(kind);
  const auto row = std::ranges::find(types, std::string_view(media_type), &BodyType::media_type);
  if (row != types.end()) return row->form;
  if (kind == BodyKind::kFile && !media_type.starts_with("multipart/")) return BodyForm::kWhole;
  return std::nullopt;
}

}  // namespace

std::span<const BodyType> body_types(BodyKind kind) {
  switch (kind) {
    case BodyKind::kNone:
      return {};
    case BodyKind::kJson:
      return kJsonTypes;
    case BodyKind::kFile:
      return kFileTypes;
    case BodyKind::kOrder:
      return kOrderTypes;
  }
  return {};
}

tl::expected<std::unique_ptr<BodyReceiver>, Problem> receiver_for(BodyKind kind, Request& request,
                                                                  const BodyRules& rules) {
  const Head& head = request.head;
  const auto declared = head.content_length;
  const auto type = head.header("content-type");
  const auto form = form_of(kind, type);
  const bool is_file = kind == BodyKind::kFile || form == BodyForm::kParts;
  const auto coding = lowered(head.header("content-encoding"));

  if (kind != BodyKind::kNone && !declared && !head.chunked)
    return tl::unexpected(Problem{"length-required", "Send a body, with Content-Length or chunked."});
  if (!coding.empty() && coding != "identity")
    return unsupported(
        "Send the body without Content-Encoding; a .nii.gz file is recognised by its content.");
  const auto limit = is_file                   ? rules.max_upload_bytes
                     : kind == BodyKind::kNone ? kMaxIgnoredBytes
                                               : kMaxTextBytes;
  if (declared.value_or(0) > limit) return too_large(limit);
  if (kind == BodyKind::kNone) return std::make_unique<IgnoredBody>();
  if (form == BodyForm::kText) return std::make_unique<TextBody>(request);
  if (!is_file)
    return unsupported(kind == BodyKind::kOrder
                           ? "Content-Type must be application/json or multipart/form-data."
                           : "Content-Type must be application/json.");
  const auto boundary = multipart_boundary(type);
  if (!form || (form == BodyForm::kParts && !boundary))
    return unsupported(
        "The multipart types here are multipart/form-data with a boundary of 1 to 70 characters and, for a "
        "volume alone, multipart/related.");
  auto file = rules.begin_upload(request.caller, declared, !head.header("idempotency-key").empty());
  if (!file) return tl::unexpected(file.error());
  request.file = std::move(*file);
  if (form == BodyForm::kParts)
    return std::make_unique<FormBody>(*boundary, kind == BodyKind::kOrder, request, rules.max_upload_bytes);
  return std::make_unique<WholeFileBody>(request, rules.max_upload_bytes);
}

}  // namespace volsmooth
