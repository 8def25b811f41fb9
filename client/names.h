#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "client/failure.h"
#include "client/quantities.h"

namespace volsmooth {

/// The name of a file or folder, also where its path ends with a slash.
std::string name_of(const std::filesystem::path& input);

/// The same without .nii, .nii.gz, .zip or .dcm: what the names of its results begin with.
std::string stem_of(const std::filesystem::path& input);

/// A name from a server goes to the disk only if it is a plain file name.
bool is_plain_name(std::string_view name);

/// The name of a result on the disk, without the stem: the server's own, but with the isovalue as the user
/// wrote it.
std::string result_name(const nlohmann::json& result, const std::vector<Isovalue>& isovalues);

/// What decides the names of a job's results before it has run.
struct NamePlan {
  std::vector<std::string> parts;  ///< the methods that it runs
  bool with_original = false;      ///< surfaces of the input beside them
  std::vector<std::string> mesh_formats;
  std::vector<std::string> outputs;
  Isovalues isovalues;
};

/// Every name that can be known beforehand, without the stem; with an automatic isovalue those of GLB files
/// are, the other surfaces' are not.
std::vector<std::string> predicted_names(const NamePlan& plan);

/// Two inputs whose results would get the same names: a usage failure that says which.
Expected<void> check_stems(const std::vector<std::filesystem::path>& inputs);

}  // namespace volsmooth
