#pragma once

#include <cmath>
#include <fstream>
#include <map>
#include <optional>

#include "tests/support/dicom_maker.h"
#include "tests/support/loopback.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {

/// A real archive, with DICOMweb and DIMSE.
class Orthanc {
 public:
  static bool is_installed() {
    return std::filesystem::exists(kProgram) && std::filesystem::exists(kDicomWeb);
  }

  Orthanc() : port_(free_port()), dimse_port_(free_port()) {
    const json settings = {{"Name", "test"},
                           {"StorageDirectory", folder_ / "storage"},
                           {"IndexDirectory", folder_ / "storage"},
                           {"HttpPort", port_},
                           {"HttpBindAddresses", {"127.0.0.1"}},
                           {"AuthenticationEnabled", false},
                           {"RemoteAccessAllowed", false},
                           {"DicomAet", "ARCHIVE"},
                           {"DicomCheckCalledAet", true},
                           {"DicomPort", dimse_port_},
                           {"DicomAlwaysAllowStore", true},
                           {"Plugins", {kDicomWeb}}};
    std::ofstream(folder_ / "settings.json") << settings;
    start();
  }

  void start() {
    process_.emplace(std::vector<std::string>{kProgram, folder_ / "settings.json"}, folder_ / "log",
                     folder_ / "log");
    const bool up = eventually([&] {
      try {
        return HttpConnection(port_).exchange("GET", "/system", {}, {}).status == 200;
      } catch (const std::runtime_error&) {
        return false;
      }
    });
    if (!up) throw std::runtime_error("Orthanc did not start:\n" + content_of(folder_ / "log"));
  }

  void stop() { process_->kill_and_wait(SIGTERM); }  ///< it can be started again

  /// A DICOM file, or a zip of them.
  void store(const std::string& file) const {
    expect_status(HttpConnection(port_).exchange("POST", "/instances", file, {}), 200);
  }

  std::string address() const { return "http://127.0.0.1:" + std::to_string(port_) + "/dicom-web"; }
  int dimse_port() const { return dimse_port_; }  ///< its AE title is ARCHIVE

  json query(const std::string& target) const {
    const HeaderFields headers{{"Accept", "application/dicom+json"}};
    return expect_status(HttpConnection(port_).exchange("GET", "/dicom-web" + target, {}, headers), 200)
        .document();
  }

 private:
  static constexpr const char* kProgram = "/usr/sbin/Orthanc";
  static constexpr const char* kDicomWeb = "/usr/share/orthanc/plugins/libOrthancDicomWeb.so";

  TemporaryDirectory folder_;
  int port_, dimse_port_;
  std::optional<ChildProcess> process_;
};

/// The first value of an attribute in DICOM JSON.
inline std::string first(const json& attributes, const std::string& tag) {
  const json& value = attributes.at(tag).at("Value").at(0);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

inline SeriesPhantom ball_series() {
  SeriesPhantom ball;
  ball.columns = ball.rows = 24;
  ball.slices = 12;
  ball.origin_mm = {-11.5, -13.5, -11};
  ball.slice_step_mm = {0, 0.3, 2};  // a tilted gantry
  ball.intensity = [](const Point& p) { return 100 - 20 * (std::hypot(p[0], p[1], p[2]) - 8); };
  return ball;
}

/// The series of modality CT that are not the source, by their UIDs, with how many instances they have.
inline std::map<std::string, int> derived_series_in(const Orthanc& archive, const std::string& study) {
  std::map<std::string, int> found;
  for (const json& series : archive.query("/studies/" + study + "/series?includefield=0008103E,00201209"))
    if (first(series, "00080060") == "CT" && series.contains("0008103E") &&
        first(series, "0008103E") == "mean-curvature-flow")
      found[first(series, "0020000E")] = std::stoi(first(series, "00201209"));
  return found;
}

}  // namespace volsmooth::test
