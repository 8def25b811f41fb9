#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "client/exit_code.h"
#include "client/quantities.h"

namespace volsmooth {

/// What a job is to do, as asked for on the command line. Defaults are the contract's; what has none is left
/// out of the order.
struct OrderOptions {
  std::string method = "mean-curvature-flow";
  nlohmann::json parameters = nlohmann::json::object();
  Isovalues isovalues;
  std::vector<std::string> mesh_formats = {"stl"};
  std::string mesh_frame;
  std::string voxel_type;
  std::vector<std::string> outputs = {"nifti"};
  std::string label;
};

/// One command line. Members that the command does not know keep their defaults.
struct Options {
  std::string command;

  std::string server;  ///< empty: none given
  bool plain_token = false;
  std::filesystem::path token_file, ca_file;
  bool json = false, quiet = false, verbose = false;

  std::vector<std::filesystem::path> inputs;
  std::filesystem::path output_folder;
  std::string stem;
  bool force = false;
  std::string id;                                          ///< of a job or a volume
  std::vector<std::pair<std::string, std::string>> query;  ///< of the upload, or of the list of jobs
  OrderOptions order;
};

/// Why there is no command to run: help was asked for (kDone), or the line was not understood (kUsage).
struct NoCommand {
  ExitCode code;
  std::string text;
};

/// Reads a command line (without the program's name) and the environment.
tl::expected<Options, NoCommand> parse_command_line(std::vector<std::string> arguments);

/// The job order for an uploaded volume.
nlohmann::json order_document(const OrderOptions& order, const std::string& volume);

}  // namespace volsmooth
