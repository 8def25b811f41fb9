#pragma once

#include <string>
#include <string_view>

namespace volsmooth {

/// Whether an archive's name for a file is one on every system: UTF-8 of at most 1,024 bytes, relative, with
/// forward slashes, no "..", no drive, no control character and none that turns the direction of writing.
bool is_safe_name(std::string_view name);

/// The same for names that one file system or another takes for the same: ASCII letters in lower case, "."
/// and empty folders left out.
std::string folded_name(std::string_view name);

}  // namespace volsmooth
