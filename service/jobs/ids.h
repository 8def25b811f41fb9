#pragma once

#include <string>
#include <string_view>

namespace volsmooth {

/// A new id that nobody can guess: `prefix` and 80 random bits, such as "j-k3v7q2m4x5n6p7ra".
std::string new_id(std::string_view prefix);

/// Whether it could have come from there, with any prefix.
bool has_form_of_new_id(std::string_view text);

/// Whether text could be an id at all: 1 to 64 of A-Z, a-z, 0-9, '-' and '_'.
bool is_id_shaped(std::string_view text);

}  // namespace volsmooth
