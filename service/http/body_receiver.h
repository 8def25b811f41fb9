#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <tl/expected.hpp>

#include "service/http/message.h"

namespace volsmooth {

/// What a route takes as its body.
enum class BodyKind {
  kNone,  ///< a small one is received and ignored
  kJson,
  kFile,   ///< the file itself, or a multipart form with the part `volume`
  kOrder,  ///< JSON, or a multipart form with the parts `volume` (a file) and `job` (JSON)
};

/// How a body brings what it brings.
enum class BodyForm {
  kText,
  kWhole,  ///< the body is the file
  kParts,  ///< a multipart form
};

struct BodyType {
  std::string_view media_type;
  BodyForm form;
};

/// The media types that a kind of body comes in: `receiver_for` and the OpenAPI document both read this. Of
/// kFile, every other type that is not a multipart is taken as application/octet-stream is.
std::span<const BodyType> body_types(BodyKind kind);

inline constexpr std::int64_t kMaxTextBytes = std::int64_t{1} << 20;

struct BodyRules {
  std::int64_t max_upload_bytes = 0;
  std::function<tl::expected<IncomingFile, Problem>(
      const Caller& caller, std::optional<std::int64_t> declared_bytes, bool may_be_repeated)>
      begin_upload;
};

/// Puts a body as it arrives into the request it belongs to. Its calls may block on the disk.
class BodyReceiver {
 public:
  virtual ~BodyReceiver() = default;
  virtual tl::expected<void, Problem> receive(std::string_view bytes) = 0;
  virtual tl::expected<void, Problem> finish() { return {}; }
};

/// Checks what the head says about the body (length-required, content-too-large, unsupported-media-type, what
/// beginning an upload gives) before any of it is read.
tl::expected<std::unique_ptr<BodyReceiver>, Problem> receiver_for(BodyKind kind, Request& request,
                                                                  const BodyRules& rules);

}  // namespace volsmooth
