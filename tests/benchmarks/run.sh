#!/usr/bin/env bash
# Usage: tests/benchmarks/run.sh [NAME...]. Sets up a fresh Debian 12, builds the benchmarks (all, or those named: flows,
# surface, io, whole_job) and prints each ratio to a peer or to a limit, measured in the same rounds on the same data and
# threads, beside what is to be reached. Leave the machine alone meanwhile: a quarter of an hour on two cores.
set -euo pipefail
cd "$(dirname "$0")/../.."
source client/setup.sh
build_folder=build-benchmarks
results=$build_folder/results
names=("$@")
(($#)) || names=(flows surface io whole_job)

# VTK's headers: the package that has them conflicts with Boost 1.81, so it is unpacked, not installed.
fetch_vtk() {
  install_packages tests/benchmarks/packages.txt
  [[ -e $build_folder/vtk/usr/include ]] && return
  mkdir -p "$build_folder/vtk"
  (cd "$build_folder/vtk" && apt-get download -q libvtk9-dev && dpkg -x libvtk9-dev_*.deb .)
}

install_packages docker/build-packages.txt tests/packages.txt
(fetch_vtk) || say "VTK cannot be had: without the ratios to FlyingEdges3D"
build "$build_folder" -DVOLSMOOTH_BENCHMARKS=ON -DVOLSMOOTH_TESTS=ON -- tests/benchmarks/all

rm -rf "$results"
mkdir -p "$results"
for name in "${names[@]}"; do
  program=$build_folder/bin/benchmark_$name
  [[ -x $program ]] || continue
  say "measuring $name"
  "$program" --benchmark_out="$results/$name.json" --benchmark_out_format=json >/dev/null
done

# value EXPRESSION: a number of the results, in which `of(BENCHMARK; COUNTER)` is a counter; nothing when it is missing.
value() {
  jq -rs "[.[].benchmarks[]] as \$all
    | def of(\$name; \$counter): first(\$all[] | select(.name | startswith(\$name))) | .[\$counter] | values;
    $1" "$results"/*.json
}

printf '\n%-62s | %8s | %5s | %7s\n' ratio measured reach stretch
while IFS='|' read -r ratio expression reach stretch; do
  [[ $ratio ]] || continue
  measured=$(value "$expression")
  if [[ -z $measured ]]; then
    measured=skipped
  elif [[ $reach == 1/* ]]; then
    measured=$(printf '1/%.1f' "$measured")
  else
    measured=$(printf '%.2f' "$measured")
  fi
  printf '%-62s | %8s | %5s | %7s\n' "$ratio" "$measured" "$reach" "$stretch"
done <<'TABLE'
MCF step, scheme of the thesis / ITK CurvatureFlow, 1 thread|of("flow_steps/threads:1"; "itk_over_mcf")|1/35|1/60
MCF step, scheme of the thesis / ITK CurvatureFlow, 2 threads|of("flow_steps/threads:2"; "itk_over_mcf")|1/35|1/60
MCF step, default scheme / ITK CurvatureFlow, 1 thread|of("flow_steps/threads:1"; "itk_over_face_centred")|1/35|1/60
MCF step, default scheme / ITK CurvatureFlow, 2 threads|of("flow_steps/threads:2"; "itk_over_face_centred")|1/35|1/60
MCF to T = 1 h^2 / ITK CurvatureFlow|of("time_to_result/flow_time:1/"; "itk_over_flow")|1/40|1/80
MCF to T = 10 h^2 / ITK CurvatureFlow|of("time_to_result/flow_time:10/"; "itk_over_flow")|1/100|1/200
MCF to T = 100 h^2 / ITK CurvatureFlow|of("time_to_result/flow_time:100/"; "itk_over_flow")|1/300|1/1000
MCF to T = 1 h^2: error / that of ITK|of("time_to_result/flow_time:1/"; "error") / of("time_to_result/flow_time:1/"; "itk_error")|1.0|
MCF to T = 10 h^2: error / that of ITK|of("time_to_result/flow_time:10/"; "error") / of("time_to_result/flow_time:10/"; "itk_error")|1.0|
MCF to T = 100 h^2: error / that of ITK|of("time_to_result/flow_time:100/"; "error") / of("time_to_result/flow_time:100/"; "itk_error")|1.0|
Laplacian to T = 10 h^2 / ITK SmoothingRecursiveGaussian|of("time_to_result/flow_time:10/"; "itk_gaussian_over_heat")|1/1|
Laplacian step / ITK Laplacian, 2 threads|of("flow_steps/threads:2"; "itk_over_laplacian")|1/1|
MCF step, scheme of the thesis / streaming copy, 1 thread|of("flow_steps/threads:1"; "mcf_over_copy")|5|3
MCF step, scheme of the thesis / streaming copy, 2 threads|of("flow_steps/threads:2"; "mcf_over_copy")|4|3
Laplacian step / streaming copy, 1 thread|of("flow_steps/threads:1"; "laplacian_over_copy")|1.5|1.2
Laplacian step / streaming copy, 2 threads|of("flow_steps/threads:2"; "laplacian_over_copy")|1.5|1.2
offset step / streaming copy, 1 thread|of("flow_steps/threads:1"; "offset_over_copy")|2.0|1.5
offset step / streaming copy, 2 threads|of("flow_steps/threads:2"; "offset_over_copy")|2.0|1.5
peak memory of explicit steps / volume in float|of("flow_memory"; "explicit_volumes")|2.2|1.2
peak memory of long steps / volume in float|of("flow_memory"; "long_volumes")||
peak memory of the Laplacian / volume in float|of("flow_memory"; "heat_volumes")||
MCF step, speed-up by the second thread|of("flow_steps/threads:1"; "mcf_seconds") / of("flow_steps/threads:2"; "mcf_seconds")|1.85|1.95
isosurface / VTK FlyingEdges3D, 1 thread|of("isosurface/threads:1"; "isosurface_over_vtk")|1.0|0.6
isosurface / VTK FlyingEdges3D, 2 threads|of("isosurface/threads:2"; "isosurface_over_vtk")|1.0|0.6
read .nii.gz / ITK, 1 thread|of("nifti/threads:1"; "read_over_itk")|0.6|0.5
read .nii.gz / ITK, 2 threads|of("nifti/threads:2"; "read_over_itk")|0.6|0.5
write .nii.gz / ITK, 1 thread|of("nifti/threads:1"; "write_over_itk")|0.2|0.12
write .nii.gz / ITK, 2 threads|of("nifti/threads:2"; "write_over_itk")|0.2|0.12
whole job / ITK and VTK, 1 thread|of("whole_job/threads:1"; "peers_over_job")|1/10|1/20
whole job / ITK and VTK, 2 threads|of("whole_job/threads:2"; "peers_over_job")|1/10|1/20
TABLE
