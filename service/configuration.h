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
  /// Throws CLI::ConfigError with what is wrong.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;
  std::string to_config(const CLI::App*, bool, bool, std::string) const override { return {}; }

  const nlohmann::json& nodes() const { return of_dicom_->at("nodes"); }
  const nlohmann::json& presets() const { return of_dicom_->at("presets"); }

 private:
  std::shared_ptr<nlohmann::json> of_dicom_ = std::make_shared<nlohmann::json>(
      nlohmann::json{{"nodes", nlohmann::json::object()}, {"presets", nlohmann::json::object()}});
};

}  // namespace volsmooth
