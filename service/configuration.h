#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace volsmooth {

/// The configuration file of the daemon: a JSON object. Its members are the long names of the options, which
/// come before it, and `nodes` and `presets`, the DICOM nodes that jobs may name and the jobs that run on
/// what devices send (pacs/nodes.h, pacs/presets.h).
class JsonConfiguration : public CLI::Config {
 public:
  /// `app` declares the options, whose names are those of the members.
  explicit JsonConfiguration(const CLI::App& app) : app_(app) {}

  /// Throws CLI::ConfigError with what is wrong.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
  /// All that is in force, as a configuration file would say it.
  std::string to_config(const CLI::App*, bool, bool, std::string) const override;

  const nlohmann::json& nodes() const { return of_dicom_->at("nodes"); }
  const nlohmann::json& presets() const { return of_dicom_->at("presets"); }

 private:
  std::vector<std::string> members() const;

  const CLI::App& app_;
  std::shared_ptr<nlohmann::json> of_dicom_ = std::make_shared<nlohmann::json>(
      nlohmann::json{{"nodes", nlohmann::json::object()}, {"presets", nlohmann::json::object()}});
};

/// For every variable NAME that an option is also given by: where NAME is not set and NAME_FILE is, NAME
/// becomes the first line of that file. So secrets need not stand in the environment. Throws
/// std::runtime_error.
void read_environment_files(const CLI::App& app);

/// Variables that look like ours, but that no option or program knows; each with the one that is most like
/// it.
std::vector<std::string> unknown_variables(const CLI::App& app);

}  // namespace volsmooth
