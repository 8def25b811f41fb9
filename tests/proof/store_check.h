#pragma once

#include <sqlite3.h>

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/child_process.h"
#include "tests/support/sha256.h"

namespace volsmooth::test {

/// What `volsmoothd audit verify` says against it.
inline std::string fault_of_audit(const std::filesystem::path& data) {
  const TemporaryDirectory folder;
  ChildProcess verifying({VOLSMOOTHD, "audit", "verify", "--data", data.string()}, folder / "out",
                         folder / "err");
  return verifying.wait() == 0 ? "" : content_of(folder / "err");
}

/// What is wrong between the rows and the files of a data directory that no daemon has open: a damaged
/// database, files that nobody refers to, files that are missing or have other bytes than their row or their
/// record says, a broken audit.
inline std::vector<std::string> faults_of_store(const std::filesystem::path& data) {
  namespace fs = std::filesystem;
  std::vector<std::string> faults;
  sqlite3* database = nullptr;
  if (sqlite3_open_v2((data / "volsmooth.db").c_str(), &database, SQLITE_OPEN_READONLY, nullptr) != SQLITE_OK)
    throw std::runtime_error("cannot open the database");
  const auto rows = [&](const char* sql, const auto& row) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database, sql, -1, &statement, nullptr) != SQLITE_OK)
      throw std::runtime_error(sqlite3_errmsg(database));
    const auto text = [&](int column) {
      const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
      return std::string(bytes == nullptr ? "" : bytes);
    };
    while (sqlite3_step(statement) == SQLITE_ROW) row(text);
    sqlite3_finalize(statement);
  };
  rows("PRAGMA integrity_check", [&](const auto& text) {
    if (text(0) != "ok") faults.push_back("database: " + text(0));
  });
  rows("PRAGMA foreign_key_check",
       [&](const auto& text) { faults.push_back("database: a row of " + text(0) + " refers to nothing"); });

  std::map<std::string, std::string> sums;  // by file
  rows("SELECT 'volumes/' || id, sha256 FROM volumes", [&](const auto& text) { sums[text(0)] = text(1); });
  rows(
      "SELECT 'results/' || jobs.id || '.' || attempt || '/' || name, sha256 FROM results JOIN jobs ON job = "
      "sequence",
      [&](const auto& text) { sums[text(0)] = text(1); });
  auto unrecorded = sums;
  rows("SELECT name, bytes, sha256, damaged FROM stored_files", [&](const auto& text) {
    const std::string name = text(0);
    if (text(3) != "0") faults.push_back(name + " is on record as damaged");
    std::error_code missing;
    if (std::to_string(fs::file_size(data / name, missing)) != text(1))
      faults.push_back(name + " has another size than its record says");
    const auto known = unrecorded.find(name);
    if (known == unrecorded.end())
      faults.push_back(name + " is on record for nobody");
    else if (known->second != text(2))
      faults.push_back(name + " has another sum on record than in its row");
    else
      unrecorded.erase(known);
  });
  for (const auto& [name, sum] : unrecorded) faults.push_back(name + " is not on record");
  sqlite3_close(database);

  std::set<std::string> found;
  for (const std::string folder : {"tmp", "volumes", "results", "arrivals"})
    for (const auto& entry : fs::recursive_directory_iterator(data / folder)) {
      const std::string name = fs::relative(entry.path(), data);
      if (entry.is_directory()) {
        if (fs::is_empty(entry.path())) faults.push_back(name + " is an empty directory");
        continue;
      }
      found.insert(name);
      const auto expected = sums.find(name);
      if (expected == sums.end())
        faults.push_back("nobody refers to " + name);
      else if (sha256_hex(content_of(entry.path())) != expected->second)
        faults.push_back(name + " has other bytes than its row says");
    }
  for (const auto& [name, sum] : sums)
    if (!found.contains(name)) faults.push_back(name + " is not there");
  if (const std::string fault = fault_of_audit(data); !fault.empty()) faults.push_back("audit: " + fault);
  return faults;
}

}  // namespace volsmooth::test
