#include "client/tables.h"

#include <algorithm>
#include <initializer_list>

#include "client/json_text.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;
using Row = std::vector<std::string>;

std::string percent(const Json& job) {
  return std::to_string(static_cast<int>(job.at("progress").at("fraction").get<double>() * 100)) + " %";
}

std::vector<Row> members(const Json& document, std::initializer_list<const char*> names) {
  std::vector<Row> rows;
  for (const char* name : names) {
    const std::string text = member_text(document, name);
    if (!text.empty()) rows.push_back({name, text});
  }
  return rows;
}

/// How the next page is asked for; empty on the last one.
std::string more_text(const Json& page) {
  const std::string cursor = member_text(page, "next_cursor");
  return cursor.empty() ? "" : "more with --cursor " + cursor + '\n';
}

}  // namespace

std::string table_text(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths;
  for (const Row& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t column = 0; column < row.size(); ++column) {
      widths[column] = std::max(widths[column], row[column].size());
    }
  }
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t column = 0; column < row.size(); ++column) {
      line += row[column] + std::string(widths[column] - row[column].size() + 2, ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

std::string volumes_text(const Json& document) {
  std::vector<Row> rows = {{"ID", "FORMAT", "SIZE", "SPACING MM", "VOXELS", "BYTES", "CREATED"}};
  for (const Json& volume : document.at("volumes")) {
    rows.push_back({member_text(volume, "id"), member_text(volume, "format"), member_text(volume, "size"),
                    member_text(volume, "spacing_mm"), member_text(volume, "voxel_type"),
                    member_text(volume, "bytes"), member_text(volume, "created_at")});
  }
  return table_text(rows) + more_text(document);
}

std::string jobs_text(const Json& document) {
  std::vector<Row> rows = {{"ID", "STATE", "DONE", "METHOD", "CREATED", "LABEL"}};
  for (const Json& job : document.at("jobs")) {
    rows.push_back({member_text(job, "id"), member_text(job, "state"), percent(job),
                    member_text(job, "method"), member_text(job, "created_at"), member_text(job, "label")});
  }
  return table_text(rows) + more_text(document);
}

std::string job_text(const Json& job) {
  std::vector<Row> rows =
      members(job, {"id", "state", "method", "label", "created_at", "started_at", "finished_at"});
  rows.push_back({"progress", percent(job) + ", " + member_text(job.at("progress"), "stage")});
  for (const auto& [name, value] : job.at("parameters").items()) rows.push_back({name, text_of(value)});
  if (const Json& error = job.at("error"); error.is_object())
    rows.push_back({"error", member_text(error, "detail")});
  std::vector<Row> results;
  for (const Json& result : job.at("results")) {
    results.push_back({"  " + member_text(result, "name"), member_text(result, "bytes") + " bytes",
                       member_text(result, "media_type")});
  }
  return table_text(rows) + (results.empty() ? "" : "results\n" + table_text(results));
}

std::string volume_text(const Json& volume) {
  std::vector<Row> rows = members(volume, {"id", "format", "size", "spacing_mm", "frame", "voxel_type",
                                           "bytes", "sha256", "created_at", "expires_at"});
  const Json intensity = volume.value("intensity", Json::object());
  rows.push_back({"intensity", member_text(intensity, "min") + " to " + member_text(intensity, "max")});
  for (const Json& warning : volume.value("warnings", Json::array()))
    rows.push_back({"warning", text_of(warning)});
  return table_text(rows);
}

}  // namespace volsmooth
