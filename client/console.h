#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

#include "client/failure.h"

namespace volsmooth {

/// What the program says: results on standard output, everything else on standard error.
struct Console {
  bool json = false;
  bool quiet = false;
  bool verbose = false;

  void line(std::string_view text) const;               ///< to standard output unless `json`
  void document(const nlohmann::json& document) const;  ///< to standard output if `json`, on one line
  void warn(std::string_view text) const;
  void note(std::string_view text) const;  ///< only if `verbose`
  void complain(const Failure& failure) const;
};

/// What `complain` prints if `json`: the server's problem document, or one made from the sentence.
nlohmann::json document_of(const Failure& failure);

}  // namespace volsmooth
