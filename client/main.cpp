#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <optional>

#include "client/commands.h"
#include "client/names.h"
#include "client/private_daemon.h"
#include "client/smooth.h"

namespace volsmooth {
namespace {

Expected<std::string> read_token(const std::filesystem::path& file) {
  const char* from_environment = std::getenv("VOLSMOOTH_TOKEN");
  std::string token = from_environment != nullptr ? from_environment : "";
  if (!file.empty()) {
    std::ifstream stream(file);
    if (!(stream >> token))
      return fail(ExitCode::kNoInput, "No token can be read from " + file.string() + ".");
  }
  for (const char c : token) {
    if (c <= ' ' || c > '~')
      return fail(ExitCode::kUsage, "The token holds what no token can hold, such as a space.");
  }
  return token;
}

Expected<void> run_on(const ServerAddress& server, bool is_private, const Options& options,
                      const Console& console, const Interruption& interruption) {
  const auto token = read_token(options.token_file);
  if (!token) return tl::unexpected(token.error());
  if (!token->empty() && !server.is_confidential() && !options.plain_token)
    return fail(
        ExitCode::kNotAllowed,
        "The token would cross the network for everybody to read; use https://, or --plain-token where "
        "something else keeps it secret.");
  HttpClient http(server, is_private ? "" : *token, interruption,
                  [&](const std::string& line) { console.note(line); });
  Api api(http);
  return run_command(options, Session{api, console, interruption, is_private});
}

Expected<void> run_privately(const Options& options, const Console& console,
                             const Interruption& interruption) {
  const auto daemon = PrivateDaemon::start(interruption, console.verbose);
  if (!daemon) return tl::unexpected(daemon.error());
  auto outcome = run_on(daemon->address(), true, options, console, interruption);
  if (!outcome && !daemon->is_running()) {
    return fail(ExitCode::kInternal,
                "The private daemon ended in the middle of the work." + daemon->last_words());
  }
  return outcome;
}

Expected<void> run(const Options& options, const Console& console) {
  const Interruption interruption;
  if (options.command == "smooth") {
    if (const auto checked = check_inputs(options.inputs); !checked) return checked;
    if (const auto checked = check_stems(options.inputs); !checked) return checked;
  }
  // What asks for no volume or job that a server holds needs none.
  const bool needs_no_server = options.command == "smooth" || options.command == "methods";
  if (needs_no_server && options.server.empty()) return run_privately(options, console, interruption);
  auto server = parse_server(options.server.empty() ? kDefaultServer : options.server);
  if (!server) return tl::unexpected(server.error());
  server->ca_file = options.ca_file;
  return run_on(*server, false, options, console, interruption);
}

bool is_all_printed() {
  return std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
}

bool has_reader_gone() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

/// Runs it and says what went wrong; only a broken promise, such as a document without its members, is thrown
/// here.
ExitCode run_and_tell(const Options& options) {
  const Console console{options.json, options.quiet, options.verbose};
  Expected<void> outcome;
  try {
    outcome = run(options, console);
  } catch (const nlohmann::json::exception& error) {
    outcome =
        fail(ExitCode::kInternal, std::string("The server's documents are not as agreed: ") + error.what());
  } catch (const std::exception& error) {
    outcome = fail(ExitCode::kInternal, error.what());
  }
  if (outcome && !is_all_printed()) {
    if (has_reader_gone()) return ExitCode::kCannotWrite;  // such as head, which wanted no more
    outcome = fail(ExitCode::kCannotWrite, "Standard output cannot be written.");
  }
  if (outcome) return ExitCode::kDone;
  console.complain(outcome.error());
  return outcome.error().code;
}

/// Started without standard streams, files that are opened would take their numbers and get what is printed.
void keep_standard_streams_open() {
  while (true) {
    Descriptor descriptor(open("/dev/null", O_RDWR));
    if (!descriptor || descriptor.get() > STDERR_FILENO) return;
    descriptor.release();
  }
}

}  // namespace
}  // namespace volsmooth

int main(int argc, char** argv) {
  using namespace volsmooth;
  keep_standard_streams_open();
  std::signal(SIGPIPE,
              SIG_IGN);  // a reader of our output that goes away must not leave a private daemon behind
  const auto options = parse_command_line({argv + 1, argv + argc});
  if (options) return static_cast<int>(run_and_tell(*options));
  const NoCommand& end = options.error();
  std::fputs(end.text.c_str(), end.code == ExitCode::kDone ? stdout : stderr);
  return static_cast<int>(is_all_printed() ? end.code : ExitCode::kCannotWrite);
}
