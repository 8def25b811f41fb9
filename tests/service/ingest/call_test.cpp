#include "service/ingest/call.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "service/ingest/commands.h"
#include "tests/support/bad_dicom.h"

namespace volsmooth {
namespace {

int memory_with(const std::string& content) {
  const int file = ::memfd_create("test", 0);
  EXPECT_EQ(::pwrite(file, content.data(), content.size(), 0), static_cast<ssize_t>(content.size()));
  return file;
}

/// A process with the descriptors of volsmooth-ingest answers, in no sandbox; what it tells of its progress.
std::vector<double> progress_of(const std::string& upload, const std::string& options) {
  const int given = memory_with(upload), said = memory_with(options), progress = memory_with("");
  const pid_t child = ::fork();
  if (child == 0) {
    for (const auto& [from, to] :
         {std::pair{given, 0}, {said, int{kOptionsDescriptor}}, {progress, int{kProgressDescriptor}}})
      ::dup2(::dup(from), to);
    const IngestCall call = open_call(read_options());
    double half = 0;
    if (!read_series(call.upload, call.series)) ::_exit(1);
    if (::pread(kProgressDescriptor, &half, sizeof half, 0) != sizeof half) ::_exit(2);
    (void)answer_inspect(call);
    ::pwrite(kProgressDescriptor, &half, sizeof half, sizeof half);
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  std::vector<double> told(2);
  EXPECT_EQ(::pread(progress, told.data(), 2 * sizeof(double), 0), ssize_t{2 * sizeof(double)});
  for (const int file : {given, said, progress}) ::close(file);
  return told;
}

TEST(IngestCall, TellsHowFarItIs) {
  const std::string options = R"({"series": "", "resample": "", "max_voxels": 1000000, "threads": 2})";
  EXPECT_EQ(progress_of(test::good_dicom_upload(), options), (std::vector{1.0, 0.5}))
      << "at the end, and when the series was read";
}

}  // namespace
}  // namespace volsmooth
