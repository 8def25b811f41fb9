#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "algorithms/formats/dicom/derived_series.h"
#include "algorithms/formats/dicom/series_voxels.h"
#include "tests/support/child_process.h"
#include "tests/support/dicom_maker.h"

namespace volsmooth::test {

inline std::span<const std::byte> as_upload(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// A series in memory, with its voxels.
struct SeriesInMemory {
  std::string upload;
  DicomSeries series;
  SeriesVoxels facts;
  std::vector<float> voxels;
};

inline SeriesInMemory read_into_memory(std::string upload, const SeriesOptions& options = {}) {
  SeriesInMemory result;
  result.upload = std::move(upload);
  auto series = read_series(as_upload(result.upload), options);
  if (!series) throw std::runtime_error(series.error().slug + ": " + series.error().detail);
  result.series = *std::move(series);
  auto facts = decode_series(
      result.series,
      [&](std::int64_t, std::span<const float> intensities, std::span<const std::uint8_t>) {
        result.voxels.insert(result.voxels.end(), intensities.begin(), intensities.end());
      },
      options.execution);
  if (!facts) throw std::runtime_error(facts.error().slug);
  result.facts = *std::move(facts);
  return result;
}

inline Derivation some_derivation() {
  Derivation derivation{.description = "mean-curvature-flow: flow_time_mm2 1",
                        .series_description = "mean-curvature-flow",
                        .code = derivation_code("mean-curvature-flow"),
                        .series_number = 9001,
                        .date = "20261125",
                        .time = "230000",
                        .software_version = "0.1.0"};
  derivation.series_seed[0] = 1;
  derivation.instance_seed[0] = 2;
  return derivation;
}

/// A derived series: its files, and what the reader makes of them.
struct Derived {
  std::vector<std::string> files;
  DerivedPixels counts;
  SeriesInMemory again;

  gdcm::DataSet attributes(std::size_t file) const { return public_attributes(as_upload(files[file])); }
};

inline Derived derive(const SeriesInMemory& source, std::span<const float> intensities,
                      const SeriesOptions& options = {}) {
  Derived derived;
  const auto take = [&](const std::string&, std::span<const std::byte> file) {
    return [&derived, text = std::string(reinterpret_cast<const char*>(file.data()), file.size())] {
      derived.files.push_back(text);
    };
  };
  const auto counts =
      write_derived_series(source.series, intensities, some_derivation(), take, options.execution);
  if (!counts) throw std::runtime_error(counts.error().slug);
  derived.counts = *counts;
  derived.again = read_into_memory(multipart_of(derived.files), options);
  return derived;
}

/// What a program prints of a DICOM file.
inline std::vector<std::string> said_by(const std::string& program, std::string_view object) {
  const TemporaryDirectory folder;
  std::ofstream(folder / "object.dcm", std::ios::binary)
      .write(object.data(), static_cast<std::streamsize>(object.size()));
  ChildProcess({program, folder / "object.dcm"}, folder / "said", folder / "said").wait();
  std::ifstream said(folder / "said");
  std::vector<std::string> lines;
  for (std::string line; std::getline(said, line);) lines.push_back(line);
  return lines;
}

inline bool installed(const std::string& program) {
  return std::filesystem::exists(program);
}

/// What dciodvfy, which knows the IODs of the standard, calls an error in an object, and what DCMTK complains
/// of; each where it is installed.
inline std::vector<std::string> errors_of_other_readers(std::string_view object) {
  const std::string dciodvfy = "/usr/bin/dciodvfy", dcmdump = "/usr/bin/dcmdump";
  std::vector<std::string> errors;
  if (installed(dciodvfy)) {
    bool named = false;  // the IOD
    for (const std::string& line : said_by(dciodvfy, object)) {
      if (line.starts_with("Error")) errors.push_back(line);
      named = named || line.find(' ') == std::string::npos;
    }
    if (!named) errors.emplace_back("dciodvfy names no IOD");
  }
  if (installed(dcmdump)) {
    for (const std::string& line : said_by(dcmdump, object))
      if (line.starts_with("E:") || line.starts_with("W:")) errors.push_back(line);
  }
  return errors;
}

}  // namespace volsmooth::test
