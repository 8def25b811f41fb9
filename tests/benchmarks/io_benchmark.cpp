// Seconds to write a 280^3 volume as .nii.gz and to read it again, each beside ITK's in the same round. Ours
// verifies what it reads.
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkNiftiImageIO.h>

#include "algorithms/formats/nifti.h"
#include "algorithms/formats/nifti_header_for.h"
#include "algorithms/volume/parallel.h"
#include "tests/benchmarks/gyroid.h"
#include "tests/benchmarks/rounds.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

void nifti(benchmark::State& state) {
  const ScratchFolder folder;
  const auto file = folder / "ours.nii.gz", peers_file = folder / "itk.nii.gz";
  const Volume::Pointer volume = gyroid();
  const NiftiHeader header = nifti_header_for(grid_of(*volume).size, {}, "float32", {});
  const auto itk_write = [&] {
    const auto writer = itk::ImageFileWriter<Volume>::New();
    writer->SetImageIO(itk::NiftiImageIO::New());
    writer->SetFileName(peers_file);
    writer->SetInput(volume);
    writer->Update();
  };
  const auto itk_read = [&] {
    const auto reader = itk::ImageFileReader<Volume>::New();
    reader->SetImageIO(itk::NiftiImageIO::New());
    reader->SetFileName(file);
    reader->Update();
  };
  Rounds rounds;
  with_threads(static_cast<int>(state.range(0)), [&] {
    for ([[maybe_unused]] auto round : state) {
      const double write = seconds([&] { write_nifti(file, *volume, header, OutputVoxelType::kFloat32); });
      const double peer_write = seconds(itk_write);
      const double read = seconds([&] {
        if (!read_nifti(file, {})) throw std::runtime_error("what was written cannot be read");
      });
      const double peer_read = seconds(itk_read);
      state.SetIterationTime(write + read);
      rounds.add("write_seconds", write);
      rounds.add("read_seconds", read);
      rounds.add("itk_write_seconds", peer_write);
      rounds.add("itk_read_seconds", peer_read);
      rounds.add("write_over_itk", write / peer_write);
      rounds.add("read_over_itk", read / peer_read);
      rounds.add("bytes", static_cast<double>(std::filesystem::file_size(file)));
      rounds.add("itk_bytes", static_cast<double>(std::filesystem::file_size(peers_file)));
    }
  });
  rounds.report(state);
}

BENCHMARK(nifti)->Arg(1)->Arg(2)->ArgName("threads")->Iterations(5)->UseManualTime();

}  // namespace
}  // namespace volsmooth

BENCHMARK_MAIN();
