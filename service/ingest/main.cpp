// volsmooth-ingest: reads untrusted DICOM for the daemon, in a sandbox. One command on one upload; call.h
// says what the descriptors are. 0: there is an answer; 2: called wrongly; 70: no sandbox; anything else: the
// upload was too much for it.

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <string>

#include "service/ingest/commands.h"
#include "service/ingest/sandbox.h"

namespace {

constexpr int kUsageError = 2, kNoSandbox = 70, kGivenUp = 1;

void write_answer(const nlohmann::json& answer) {
  const std::string text = answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t written = ::write(volsmooth::kAnswerDescriptor, text.data() + at, text.size() - at);
    if (written <= 0) ::_exit(kGivenUp);
    at += static_cast<std::size_t>(written);
  }
}

/// Files come and go one by one: memory that is freed is kept for the next, which halves the time. All
/// threads share one arena, lest each set addresses aside.
void keep_freed_memory() {
  constexpr int kMiB = 1 << 20;
  ::mallopt(M_ARENA_MAX, 1);
  ::mallopt(M_MMAP_THRESHOLD, 32 * kMiB);
  ::mallopt(M_TRIM_THRESHOLD, 512 * kMiB);
  ::mallopt(M_TOP_PAD, 64 * kMiB);
}

volsmooth::SandboxLimits limits_of(const nlohmann::json& options) {
  return {.address_space_bytes = options.at("address_space_bytes").get<std::int64_t>(),
          .cpu_seconds = options.at("cpu_seconds").get<std::int64_t>(),
          .output_bytes = options.at("output_bytes").get<std::int64_t>()};
}

}  // namespace

int main(int argc, char** argv) {
  const auto commands = volsmooth::ingest_commands();
  const auto command =
      argc == 2 ? std::ranges::find(commands, argv[1], &volsmooth::IngestCommand::name) : commands.end();
  if (command == commands.end()) return kUsageError;
  keep_freed_memory();
  volsmooth::IngestCall call;
  try {
    call = volsmooth::open_call(volsmooth::read_options());
    volsmooth::enter_sandbox(limits_of(call.options));
  } catch (const std::exception&) {
    return kNoSandbox;
  }
  try {
    write_answer(command->run(call));
  } catch (const std::exception&) {
    ::_exit(kGivenUp);
  }
  ::_exit(0);  // nothing of what untrusted bytes made is run again
}
