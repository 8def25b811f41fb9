// Seconds for an isosurface of a 280^3 volume, closed and with normals, each beside one of vtkFlyingEdges3D
// (with normals, not closed) in the same round.
#include "algorithms/surface/isosurface.h"
#include "algorithms/volume/parallel.h"
#include "tests/benchmarks/gyroid.h"
#include "tests/benchmarks/rounds.h"
#include "tests/benchmarks/vtk_peer.h"

namespace volsmooth {
namespace {

constexpr double kIsovalue = 100;

void isosurface(benchmark::State& state) {
  const auto threads = static_cast<int>(state.range(0));
  const Volume::Pointer volume = gyroid();
  FlyingEdges peer(voxels_of(*volume).data(), grid_of(*volume).size);
  Rounds rounds;
  with_threads(threads, [&] {
    for ([[maybe_unused]] auto round : state) {
      Mesh mesh;
      const double ours = seconds([&] { mesh = extract_isosurface(*volume, {}, kIsovalue); });
      std::int64_t vtk_triangles = 0;
      const double vtk = seconds([&] { vtk_triangles = peer.extract(kIsovalue, threads); });
      state.SetIterationTime(ours);
      rounds.add("isosurface_seconds", ours);
      rounds.add("vtk_seconds", vtk);
      rounds.add("isosurface_over_vtk", ours / vtk);
      rounds.add("triangles", static_cast<double>(mesh.triangles.size()));
      rounds.add("vtk_triangles", static_cast<double>(vtk_triangles));
    }
  });
  rounds.report(state);
}

BENCHMARK(isosurface)->Arg(1)->Arg(2)->ArgName("threads")->Iterations(9)->UseManualTime();

}  // namespace
}  // namespace volsmooth

BENCHMARK_MAIN();
