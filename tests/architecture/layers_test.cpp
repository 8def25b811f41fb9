#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = VOLSMOOTH_SOURCE_DIR;

/// What the sources in a directory may include of the project beside their own directory, by path prefix.
const std::map<std::string, std::vector<std::string>> kMayInclude = {
    {"algorithms", {"algorithms/"}},
    {"algorithms/numerics", {}},
    {"algorithms/volume", {"algorithms/progress.h", "algorithms/numerics/"}},
    {"algorithms/flows", {"algorithms/progress.h", "algorithms/volume/", "algorithms/numerics/"}},
    {"algorithms/surface", {"algorithms/progress.h", "algorithms/volume/", "algorithms/numerics/"}},
    {"algorithms/formats",
     {"algorithms/progress.h", "algorithms/volume/", "algorithms/surface/mesh.h",
      "algorithms/surface/vector_math.h"}},
    {"algorithms/formats/dicom",
     {"algorithms/progress.h", "algorithms/volume/geometry.h", "algorithms/formats/",
      "algorithms/surface/mesh.h", "algorithms/surface/vector_math.h"}},
    {"service", {"service/"}},
    {"service/process", {}},
    {"service/control", {"service/process/descriptor.h"}},
    {"service/storage", {}},
    {"service/jobs", {"service/storage/", "algorithms/method_info.h", "algorithms/progress.h"}},
    {"service/http",
     {"service/jobs/", "service/storage/incoming_file.h", "service/storage/digest.h",
      "service/storage/checked_file.h", "algorithms/method_info.h"}},
    {"service/pipeline",
     {"service/jobs/job.h", "service/jobs/problem.h", "service/jobs/job_json.h", "service/process/",
      "algorithms/"}},
    {"service/ingest",
     {"algorithms/formats/", "algorithms/volume/geometry.h", "algorithms/surface/mesh.h",
      "service/process/confinement.h", "service/process/check.h", "service/process/write_all.h"}},
    {"service/dimse", {"service/process/confinement.h"}},
    {"service/pacs",
     {"service/jobs/", "service/storage/incoming_file.h", "service/storage/posix.h", "service/process/",
      "service/dimse/channel.h", "algorithms/progress.h", "algorithms/formats/zip_"}},
    {"client", {}},
};

/// Libraries that only the named directories may see.
const std::map<std::string, std::vector<std::string>> kLibraryHomes = {
    {"itk", {"algorithms/volume"}},
    {"boost/", {"service/http", "service/pacs"}},
    {"sqlite3", {"service/storage"}},
    {"spdlog/", {"service", "service/http", "service/jobs"}},
    {"prometheus/", {"service/http"}},
    {"curl/", {"client", "service/pacs"}},
    {"png", {"algorithms/formats"}},
    {"isa-l", {"algorithms/formats", "algorithms/formats/dicom", "service/storage"}},
    {"gdcm", {"algorithms/formats/dicom"}},
    {"dcmtk/", {"service/dimse"}},
    {"seccomp", {"service/process"}},
    {"nlohmann/",
     {"service", "service/http", "service/jobs", "service/pacs", "service/pipeline", "service/ingest",
      "service/dimse", "client"}},
};

struct Include {
  fs::path file;  ///< relative to the root
  std::string target;
  bool own;  ///< written with quotes
};

std::vector<Include> includes_under(const std::string& part) {
  static const std::regex pattern(R"(^\s*#\s*include\s*(["<])([^">]+)[">])");
  std::vector<Include> found;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / part)) {
    const fs::path& path = entry.path();
    if (path.extension() != ".h" && path.extension() != ".cpp") continue;
    std::ifstream in(path);
    std::smatch match;
    for (std::string line; std::getline(in, line);) {
      if (std::regex_search(line, match, pattern)) {
        found.push_back({fs::relative(path, kRoot), match[2], match[1] == "\""});
      }
    }
  }
  return found;
}

std::vector<Include> all_includes() {
  std::vector<Include> all;
  for (const char* part : {"algorithms", "service", "client"})
    std::ranges::move(includes_under(part), std::back_inserter(all));
  return all;
}

bool starts_with_any(const std::string& text, const std::vector<std::string>& prefixes) {
  return std::ranges::any_of(prefixes, [&](const std::string& prefix) { return text.starts_with(prefix); });
}

std::string say(const Include& include) {
  return include.file.string() + " includes " + include.target;
}

TEST(Layers, EveryDirectoryHasARule) {
  for (const Include& include : all_includes()) {
    EXPECT_TRUE(kMayInclude.contains(include.file.parent_path()))
        << include.file << ": no rule for its directory";
  }
}

TEST(Layers, DependenciesPointOneWay) {
  const auto includes = all_includes();
  ASSERT_GT(includes.size(), 100U);
  for (const Include& include : includes) {
    if (!include.own) continue;
    const std::string home = include.file.parent_path();
    const bool at_home = fs::path(include.target).parent_path() == home;
    EXPECT_TRUE(at_home || starts_with_any(include.target, kMayInclude.at(home))) << say(include);
  }
}

TEST(Layers, LibrariesStayInTheirHomes) {
  for (const Include& include : all_includes()) {
    for (const auto& [library, homes] : kLibraryHomes) {
      if (include.own || !include.target.starts_with(library)) continue;
      EXPECT_THAT(homes, testing::Contains(include.file.parent_path().string())) << say(include);
    }
  }
}

TEST(Layers, TheTopLevelIsFixed) {
  std::vector<std::string> allowed = {"service", "algorithms",     "client",   "docker",
                                      "tests",   "CMakeLists.txt", "README.md"};
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    const std::string name = entry.path().filename();
    const bool made_here = name.starts_with(".") || name.starts_with("build") || name == "demo-output";
    EXPECT_TRUE(made_here || std::ranges::find(allowed, name) != allowed.end()) << name;
  }
}

}  // namespace
