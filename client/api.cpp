#include "client/api.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "client/descriptor.h"
#include "client/packed_folder.h"

namespace volsmooth {
namespace {

constexpr std::chrono::seconds kShortCall{
    30};  ///< for calls that must not hang, as they cannot be interrupted
constexpr std::chrono::seconds kCancelCall{5};

std::string encoded(std::string_view text) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                       std::string_view("-._~").find(c) != std::string_view::npos;
    if (plain) {
      out += c;
    } else {
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

std::string target_of(std::string_view path, const Query& query) {
  std::string target(path);
  char separator = '?';
  for (const auto& [name, value] : query) {
    target += separator + encoded(name) + '=' + encoded(value);
    separator = '&';
  }
  return target;
}

std::string job_path(std::string_view id) {
  return "/v1/jobs/" + encoded(id);
}
std::string volume_path(std::string_view id) {
  return "/v1/volumes/" + encoded(id);
}

Failure failure_of(const Response& response) {
  const auto problem = nlohmann::json::parse(response.body, nullptr, false);
  if (!problem.is_object()) {
    return {
        exit_code_for(response.status, ""),
        "The server answered " + std::to_string(response.status) + " without saying why; is it volsmoothd?",
        {}};
  }
  return {exit_code_for(response.status, slug_of(problem)), sentence_of(problem), problem};
}

}  // namespace

Expected<nlohmann::json> Api::methods() {
  return document({.target = "/v1/methods"});
}

Expected<nlohmann::json> Api::upload(const std::filesystem::path& input, const Query& options,
                                     const Sent& on_sent) {
  std::error_code ignored;
  return std::filesystem::is_directory(input, ignored) ? upload_folder(input, options, on_sent)
                                                       : upload_file(input, options, on_sent);
}

Expected<nlohmann::json> Api::upload_folder(const std::filesystem::path& folder, const Query& options,
                                            const Sent& on_sent) {
  const auto packed = pack_folder(folder);
  if (!packed) return tl::unexpected(packed.error());
  return upload_body(packed->body, packed->bytes, packed->content_type, options, on_sent);
}

Expected<nlohmann::json> Api::upload_file(const std::filesystem::path& file, const Query& options,
                                          const Sent& on_sent) {
  const Descriptor descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (!descriptor || fstat(descriptor.get(), &status) != 0) {
    return fail(ExitCode::kNoInput, file.string() + " cannot be read: " + std::strerror(errno) + ".");
  }
  return upload_body(descriptor, status.st_size, "application/octet-stream", options, on_sent);
}

Expected<nlohmann::json> Api::upload_body(const Descriptor& descriptor, std::int64_t bytes,
                                          const std::string& content_type, const Query& options,
                                          const Sent& on_sent) {
  const FileBody body{descriptor.get(), bytes, [&](std::int64_t sent) { on_sent(sent, bytes); }};
  return document({.method = "POST",
                   .target = target_of("/v1/volumes", options),
                   .content_type = content_type,
                   .file = &body,
                   .idempotency_key = new_idempotency_key()});
}

Expected<nlohmann::json> Api::volumes(const Query& filter) {
  return document({.target = target_of("/v1/volumes", filter)});
}

Expected<nlohmann::json> Api::volume(std::string_view id) {
  return document({.target = volume_path(id)});
}

Expected<void> Api::delete_volume(std::string_view id) {
  return nothing(
      {.method = "DELETE", .target = volume_path(id), .interruptible = false, .timeout = kShortCall});
}

Expected<nlohmann::json> Api::submit(const Json& order) {
  return document({.method = "POST",
                   .target = "/v1/jobs",
                   .content_type = "application/json",
                   .body = order.dump(),
                   .idempotency_key = new_idempotency_key(),
                   .interruptible = false,
                   .timeout = kShortCall});
}

Expected<nlohmann::json> Api::job(std::string_view id) {
  return document({.target = job_path(id)});
}

Expected<nlohmann::json> Api::wait(std::string_view id, std::chrono::seconds time) {
  return document({.target = target_of(job_path(id), {{"wait", std::to_string(time.count())}})});
}

Expected<nlohmann::json> Api::jobs(const Query& query) {
  return document({.target = target_of("/v1/jobs", query)});
}

Expected<nlohmann::json> Api::cancel(std::string_view id) {
  return document(
      {.method = "POST", .target = job_path(id) + "/cancel", .interruptible = false, .timeout = kCancelCall});
}

Expected<void> Api::delete_job(std::string_view id) {
  return nothing({.method = "DELETE", .target = job_path(id)});
}

Expected<void> Api::download(std::string_view job, std::string_view name,
                             const std::function<Expected<void>(std::string_view)>& sink) {
  return nothing({.target = job_path(job) + "/results/" + encoded(name), .sink = sink});
}

Expected<Response> Api::success(const Request& request) {
  auto response = http_.send(request);
  if (response && (response->status < 200 || response->status > 299))
    return tl::unexpected(failure_of(*response));
  return response;
}

Expected<nlohmann::json> Api::document(const Request& request) {
  const auto response = success(request);
  if (!response) return tl::unexpected(response.error());
  auto parsed = Json::parse(response->body, nullptr, false);
  if (!parsed.is_object()) {
    return fail(ExitCode::kInternal,
                "The server at " + http_.server().as_written + " does not speak volsmooth's language.");
  }
  return parsed;
}

Expected<void> Api::nothing(const Request& request) {
  return success(request).map([](const Response&) {});
}

}  // namespace volsmooth
