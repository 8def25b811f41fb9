#include "client/console.h"

#include <cstdio>

#include "client/printable.h"

namespace volsmooth {
namespace {

void say(std::FILE* stream, std::string_view start, std::string_view text) {
  std::fprintf(stream, "%.*s%.*s\n", static_cast<int>(start.size()), start.data(),
               static_cast<int>(text.size()), text.data());
}

}  // namespace

void Console::line(std::string_view text) const {
  if (!json) say(stdout, "", text);
}

void Console::document(const nlohmann::json& document) const {
  // A path need not be UTF-8; JSON must be.
  if (json) say(stdout, "", document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

void Console::warn(std::string_view text) const {
  if (!quiet) say(stderr, "volsmooth: warning: ", printable(text));
}

void Console::note(std::string_view text) const {
  if (verbose) say(stderr, "volsmooth: ", printable(text));
}

void Console::complain(const Failure& failure) const {
  say(stderr, "volsmooth: ", failure.sentence);
  document(document_of(failure));
}

nlohmann::json document_of(const Failure& failure) {
  if (!failure.problem.is_null()) return failure.problem;
  return {{"type", "about:blank"}, {"title", "volsmooth could not do this"}, {"detail", failure.sentence}};
}

}  // namespace volsmooth
