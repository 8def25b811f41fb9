#include "client/failure.h"

#include "client/printable.h"

namespace volsmooth {

std::string sentence_of(const nlohmann::json& problem) {
  if (problem.is_object()) {
    for (const char* member : {"detail", "title"}) {
      const auto text = problem.find(member);
      if (text != problem.end() && text->is_string()) return printable(text->get<std::string>());
    }
  }
  return "The server does not say what is wrong.";
}

}  // namespace volsmooth
