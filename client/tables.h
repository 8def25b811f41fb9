#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace volsmooth {

/// Rows in aligned columns, a line each.
std::string table_text(const std::vector<std::vector<std::string>>& rows);

std::string volumes_text(const nlohmann::json& document);  ///< of GET /v1/volumes
std::string jobs_text(const nlohmann::json& document);     ///< of GET /v1/jobs
std::string job_text(const nlohmann::json& job);
std::string volume_text(const nlohmann::json& volume);

}  // namespace volsmooth
