#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/descriptor.h"
#include "client/http.h"

namespace volsmooth {

/// The members of a URL's query; values are encoded when it is made.
using Query = std::vector<std::pair<std::string, std::string>>;

/// The calls of the REST contract. Documents come back as they were sent; a problem document becomes a
/// failure with its detail and the exit code that it means.
class Api {
 public:
  explicit Api(HttpClient& http) : http_(http) {}

  using Json = nlohmann::json;
  using Sent = std::function<void(std::int64_t sent, std::int64_t bytes)>;

  Expected<Json> methods();
  /// A folder is packed first (packed_folder.h).
  Expected<Json> upload(const std::filesystem::path& input, const Query& options, const Sent& on_sent);
  Expected<Json> volumes(const Query& filter);
  Expected<Json> volume(std::string_view id);
  Expected<void> delete_volume(std::string_view id);

  Expected<Json> submit(const Json& order);  ///< never interrupted half-way: a job is not made unnoticed
  Expected<Json> job(std::string_view id);
  Expected<Json> wait(std::string_view id, std::chrono::seconds time);
  Expected<Json> jobs(const Query& query);
  Expected<Json> cancel(std::string_view id);  ///< goes through after an interruption too
  Expected<void> delete_job(std::string_view id);
  Expected<void> download(std::string_view job, std::string_view name,
                          const std::function<Expected<void>(std::string_view)>& sink);

 private:
  Expected<Json> upload_file(const std::filesystem::path& file, const Query& options, const Sent& on_sent);
  Expected<Json> upload_folder(const std::filesystem::path& folder, const Query& options,
                               const Sent& on_sent);
  Expected<Json> upload_body(const Descriptor& body, std::int64_t bytes, const std::string& content_type,
                             const Query& options, const Sent& on_sent);
  Expected<Json> document(const Request& request);
  Expected<void> nothing(const Request& request);
  Expected<Response> success(const Request& request);

  HttpClient& http_;
};

}  // namespace volsmooth
