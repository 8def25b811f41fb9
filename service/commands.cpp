#include "service/commands.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <charconv>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "service/control/control_socket.h"
#include "service/jobs/data_folder.h"
#include "service/jobs/job_json.h"
#include "service/jobs/tokens.h"
#include "service/storage/file_store.h"

namespace volsmooth {
namespace {

using nlohmann::json;

/// Such as 90d, 12h, 30m or 45s.
std::chrono::seconds lifetime_from(const std::string& text) {
  const std::map<char, std::int64_t> units = {{'s', 1}, {'m', 60}, {'h', 3600}, {'d', 86400}};
  constexpr std::int64_t kMost = std::int64_t{100} * 365 * 86400;
  std::int64_t count = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, count);
  const auto unit = rest + 1 == end ? units.find(*rest) : units.end();
  if (error != std::errc() || unit == units.end() || count < 1 || count > kMost / unit->second)
    throw std::runtime_error(
        "--expires takes a number of days, hours, minutes or seconds, such as 90d or 12h");
  return std::chrono::seconds(count * unit->second);
}

json token_document(const Token& token) {
  json scopes = json::array();
  for (const Scope scope : token.scopes) scopes.push_back(name_of(scope));
  const auto time_or_null = [](const std::optional<Time>& time) {
    return time ? json(rfc3339(*time)) : json();
  };
  return {{"name", token.name},
          {"tenant", token.tenant},
          {"scopes", scopes},
          {"created_at", rfc3339(token.created_at)},
          {"expires_at", time_or_null(token.expires_at)},
          {"revoked_at", time_or_null(token.revoked_at)}};
}

json problem(const std::string& detail) {
  return {{"problem", detail}};
}

json create_token(Tokens& tokens, const json& request) {
  Token token;
  token.name = request.at("name");
  token.tenant = request.at("tenant");
  for (const auto& name : request.at("scopes"))
    if (const auto scope = scope_from(name.get<std::string>())) token.scopes.push_back(*scope);
  if (request.contains("expires_seconds"))
    token.expires_at =
        now_in_milliseconds() + std::chrono::seconds(request.at("expires_seconds").get<std::int64_t>());
  const auto text = tokens.create(std::move(token));
  return text ? json{{"token", *text}} : problem(text.error().detail);
}

json answer_about_tokens(Tokens& tokens, const json& request) {
  const std::string command = request.at("command");
  if (command == "token create") return create_token(tokens, request);
  if (command == "token list") {
    json documents = json::array();
    for (const Token& token : tokens.all()) documents.push_back(token_document(token));
    return {{"tokens", documents}};
  }
  if (command == "token revoke") {
    const auto revoked = tokens.revoke(request.at("name").get<std::string>());
    return revoked ? json::object() : problem(revoked.error().detail);
  }
  return problem("the daemon does not know this command; is it of another version?");
}

json answer_without_daemon(const std::filesystem::path& data_dir, const json& request) {
  if (request.at("command") == "status") return problem("no daemon runs on this data folder");
  if (request.at("command") != "token create") {
    database_in(data_dir);
  } else if (!std::filesystem::exists(data_dir / kDatabaseFile)) {
    std::cerr << "volsmoothd: " << data_dir.string()
              << " is new: the token is for a daemon with this --data\n";
  }
  const FileStore files(own_data_folder(data_dir));  // holds it for this process
  StoreDatabase database(files.path_of(kDatabaseFile));
  const ActingFor user(user_of_this_machine(::geteuid()));
  Tokens tokens(database);
  return answer_about_tokens(tokens, request);
}

json answer_to(const std::filesystem::path& data_dir, const json& request) {
  const auto asked = ask_daemon(data_dir, request.dump());
  json answer = asked ? json::parse(*asked) : answer_without_daemon(data_dir, request);
  if (answer.contains("problem")) throw std::runtime_error(answer.at("problem").get<std::string>());
  return answer;
}

std::string state_of(const json& token) {
  if (!token.at("revoked_at").is_null()) return "revoked " + token.at("revoked_at").get<std::string>();
  if (token.at("expires_at").is_null()) return "never expires";
  const bool over = token.at("expires_at").get<std::string>() <= rfc3339(now_in_milliseconds());
  return (over ? "expired " : "expires ") + token.at("expires_at").get<std::string>();
}

/// A line for each: name, tenant, scopes, state.
void print_tokens(const json& tokens) {
  for (const json& token : tokens) {
    std::string scopes;
    for (const auto& scope : token.at("scopes"))
      scopes += (scopes.empty() ? "" : ",") + scope.get<std::string>();
    std::cout << token.at("name").get<std::string>() << '\t' << token.at("tenant").get<std::string>() << '\t'
              << scopes << '\t' << state_of(token) << '\n';
  }
}

}  // namespace

Commands::Commands(CLI::App& app) : tenant_(kDefaultTenant) {
  CLI::App* const token = app.add_subcommand("token", "Makes, lists and revokes access tokens");
  token->fallthrough()->require_subcommand(1);
  create_ = token->add_subcommand("create", "Makes a token and prints it, this once");
  list_ = token->add_subcommand("list", "Lists the tokens: name, tenant, scopes, state");
  revoke_ = token->add_subcommand("revoke", "Revokes a token, at once");
  status_ =
      app.add_subcommand("status", "Says whether the daemon of the data folder takes jobs (exit code 0)");
  for (CLI::App* command : {create_, list_, revoke_, status_}) command->fallthrough();
  create_->add_option("--name", name_, "What it is called in lists and in the audit")->required();
  create_->add_option("--scope", scopes_, "What it allows, such as read,submit")
      ->required()
      ->delimiter(',')
      ->check(CLI::IsMember({"read", "submit", "admin"}));
  create_->add_option("--tenant", tenant_, "Whose volumes and jobs it sees and makes")->capture_default_str();
  create_->add_option("--expires", lifetime_,
                      "How long it holds, such as 90d or 12h; default: until revoked");
  revoke_->add_option("--name", name_, "Its name")->required();
}

bool Commands::asked() const {
  return create_->parsed() || list_->parsed() || revoke_->parsed() || status_->parsed();
}

int Commands::run(const std::filesystem::path& data_dir) const {
  json request = {{"command", list_->parsed()     ? "token list"
                              : create_->parsed() ? "token create"
                              : revoke_->parsed() ? "token revoke"
                                                  : "status"}};
  if (!name_.empty()) request["name"] = name_;
  if (create_->parsed()) {
    request["scopes"] = scopes_;
    request["tenant"] = tenant_;
    if (!lifetime_.empty()) request["expires_seconds"] = lifetime_from(lifetime_).count();
  }
  const json answer = answer_to(data_dir, request);
  if (answer.contains("token") && !(std::cout << answer.at("token").get<std::string>() << std::endl)) {
    answer_to(data_dir, {{"command", "token revoke"}, {"name", name_}});
    throw std::runtime_error("the token could not be printed, so it was revoked");
  }
  if (answer.contains("tokens")) print_tokens(answer.at("tokens"));
  if (answer.contains("status")) std::cout << answer.at("status").get<std::string>() << '\n';
  return 0;
}

void audit_command(const std::filesystem::path& data_dir, const std::string& action,
                   const std::string& object) {
  const json request = {{"command", "audit"}, {"action", action}, {"object", object}};
  if (const auto answer = ask_daemon(data_dir, request.dump())) {
    if (json::parse(*answer).contains("problem"))
      throw std::runtime_error("the daemon could not audit this, so it is not done; see its log");
    return;
  }
  const FileStore files(own_data_folder(data_dir));  // holds it for this process
  const ActingFor user(user_of_this_machine(::geteuid()));
  StoreDatabase(files.path_of(kDatabaseFile)).record({action, object});
}

std::string answer_command(JobService& jobs, const std::string& text, uid_t user) {
  try {
    const ActingFor on_behalf(user_of_this_machine(user));
    const json request = json::parse(text);
    if (request.at("command") == "audit") {
      jobs.audit_done({request.at("action"), request.at("object")});
      return json::object().dump();
    }
    if (request.at("command") != "status") return answer_about_tokens(jobs.tokens(), request).dump();
    const auto reason = jobs.not_ready_because();
    return (reason ? problem("not ready: " + *reason) : json{{"status", "ready"}}).dump();
  } catch (const std::exception& error) {
    spdlog::error("a command of the user {} could not be done: {}", user, error.what());
    return problem("the daemon could not do this; see its log").dump();
  }
}

}  // namespace volsmooth
