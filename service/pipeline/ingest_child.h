#pragma once

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <tl/expected.hpp>

#include "algorithms/progress.h"
#include "service/jobs/problem.h"
#include "service/process/descriptor.h"

namespace volsmooth {

/// One command for volsmooth-ingest, the program that reads untrusted DICOM (service/ingest/call.h says what
/// the descriptors are).
struct IngestOrder {
  std::string command;
  int upload = -1;                    ///< a descriptor of the upload
  int output = -1;                    ///< where the command's product goes, if it has one
  int input = -1;                     ///< what it needs beside the upload, if anything
  nlohmann::json options = {};        ///< with address_space_bytes, cpu_seconds and output_bytes
  std::chrono::seconds patience{60};  ///< then it is killed
};

/// How long a child with these options may take: several times its CPU time, for others want the processor
/// too.
std::chrono::seconds patience_for(const nlohmann::json& options);

/// volsmooth-ingest beside the running program.
std::filesystem::path ingest_beside_this_program();

/// Runs `program` in a process of its own and gives its answer. `report` is called ten times a second with
/// how far the child says that it is; the child is killed when it throws. A refusal is the problem that it
/// says; a child that dies, gives up or takes too long is dicom-decode-failed. Throws std::system_error when
/// no child can be started, std::runtime_error when it has no sandbox.
tl::expected<nlohmann::json, Problem> run_ingest(const std::filesystem::path& program,
                                                 const IngestOrder& order, const Progress& report);

/// An empty file in memory that a child can be given; throws std::system_error.
Descriptor memory_file(const char* name);

}  // namespace volsmooth
