#include <algorithm>
#include <fstream>
#include <functional>
#include <system_error>
#include <utility>

#include "algorithms/formats/mesh_writers.h"
#include "algorithms/formats/picture.h"
#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/otsu.h"
#include "algorithms/volume/parallel.h"
#include "service/pipeline/costs.h"
#include "service/pipeline/dicom_results.h"
#include "service/pipeline/parts.h"
#include "service/pipeline/reading.h"
#include "service/pipeline/report.h"
#include "service/pipeline/results_size.h"
#include "service/pipeline/stage_clock.h"
#include "service/pipeline/stages.h"

namespace volsmooth {
namespace {

const char* const kOriginal = "original";

/// One job from the uploaded file to the finished results.
class JobRun {
 public:
  JobRun(const ComputeTask& task, const StageProgress& report, const PipelineLimits& limits)
      : task_(task),
        parts_(parts_of(task.order, task.parameters, input_of(task.volume.facts))),
        limits_(limits),
        surface_bytes_(limits.max_memory_bytes / 4),
        held_(held_for_results(task.order, task.volume.facts, parts_.size(),
                               task.order.isovalues ? task.order.isovalues->size() : 1)),
        parts_to_come_(parts_.size()),
        dicom_(task, limits),
        voxels_(static_cast<double>(voxel_count(task.volume.facts.size))),
        clock_(
            total_cost(parts_, static_cast<double>(task.order.isovalues ? task.order.isovalues->size() : 1),
                       input_of(task.volume.facts).grid),
            report) {}

  tl::expected<std::vector<Result>, Problem> run() {
    auto loaded = clock_.run("read", kReadCost * voxels_, [&](const Progress& progress) {
      const Descriptor* const kept = wanted("dicom-series") ? &dicom_.voxel_memory() : nullptr;
      return read_volume(task_.volume_file, task_.volume, limits_, progress, kept);
    });
    if (!loaded) return tl::unexpected(loaded.error());
    description_ = std::move(loaded->description);
    padding_ = std::move(loaded->padding);
    warnings_ = description_.warnings;
    original_ = loaded->volume;

    measure_original();
    const bool flat = !original_surfaces_.empty() && original_surfaces_.front().triangles.empty();
    if (flat) warnings_.push_back("no-surface: the volume is one voxel thick, so it has no closed surface.");
    if (parts_.size() > 1 && !flat) write_meshes(kOriginal, original_surfaces_);
    for (const Part& part : parts_) run_part(part);
    clock_.run("write", 0, [&](const Progress& progress) {
      write_report();
      progress(1);
    });
    return std::move(results_);
  }

 private:
  void measure_original() {
    clock_.run("flow", kMeasureCost * voxels_,
               [&](const Progress& progress) { original_foliation_ = measure(*original_, progress); });
    clock_.run("surfaces", kMeasureCost * voxels_, [&](const Progress& progress) {
      original_slices_ = middle_slices(*original_, description_.map);
      isovalues_ = isovalues_of_order(progress);
    });
    original_surfaces_ = surfaces_of(*original_);
    clock_.run("surfaces", 0, [&](const Progress& progress) {
      for (const Mesh& surface : original_surfaces_) original_measures_.push_back(measure(surface, progress));
    });
  }

  /// "auto" is the surface that the order speaks of, or Otsu's threshold.
  std::vector<double> isovalues_of_order(const Progress& progress) {
    if (task_.order.isovalues) return *task_.order.isovalues;
    if (const auto surface = surface_of(task_.parameters)) return {*surface};
    return {otsu_threshold(*original_, progress, description_.padding_value)};
  }

  VoxelToWorld map_of_surfaces() const {
    const Frame frame = task_.order.mesh_frame.empty()    ? description_.map.frame
                        : task_.order.mesh_frame == "LPS" ? Frame::kLps
                                                          : Frame::kRas;
    return in_frame(description_.map, frame);
  }

  std::vector<Mesh> surfaces_of(const Volume& volume) {
    const VoxelToWorld map = map_of_surfaces();
    std::vector<Mesh> surfaces;
    for (const double isovalue : isovalues_) {
      clock_.run("surfaces", kSurfaceCost / 2 * voxels_, [&](const Progress& progress) {
        surfaces.push_back(
            extract_isosurface(volume, map, isovalue, {.max_bytes = surface_bytes_}, progress));
      });
    }
    return surfaces;
  }

  void run_part(const Part& part) {
    const std::string& name = part.method->info.name;
    --parts_to_come_;
    const Volume::Pointer volume = volume_for(part);
    dicom_.begin_method(name, part.parameters);
    FoliationRow foliation{name, part.parameters, original_foliation_, {}, {}, {}};
    clock_.run("flow", kStepCost * passes_of(part, input_of(task_.volume.facts).grid) * voxels_,
               [&](const Progress& progress) {
                 foliation.integration = part.method->run(*volume, part.parameters, progress);
               });
    clock_.run("flow", kMeasureCost * voxels_,
               [&](const Progress& progress) { foliation.after = measure(*volume, progress); });

    clock_.run("write", kWriteCost * voxels_, [&](const Progress& progress) {
      foliation.written = write_volume(name, *volume, progress);
      if (wanted("dicom-series")) write_dicom_series(name, *volume, progress);
      write_picture(new_result(name + ".png", "picture", name, "image/png"), original_slices_,
                    middle_slices(*volume, description_.map), isovalues_);
    });

    std::vector<Mesh> surfaces = surfaces_of(*volume);
    for (std::size_t which = 0; which < surfaces.size(); ++which)
      measure_surface(name, surfaces[which], which);
    std::erase_if(surfaces, [](const Mesh& surface) { return surface.triangles.empty(); });
    write_meshes(name, surfaces);
    write_dicom_surfaces(name, surfaces);
    foliation_rows_.push_back(std::move(foliation));
  }

  /// The input for `part` to work on: the only one when no later part needs it.
  Volume::Pointer volume_for(const Part& part) {
    if (&part == &parts_.back()) return std::exchange(original_, nullptr);
    return clock_.run("read", 0, [&](const Progress& progress) { return copy_of(*original_, progress); });
  }

  WriteOutcome write_volume(const std::string& method, Volume& volume, const Progress& progress) {
    if (!wanted("nifti")) return {};
    const auto type =
        task_.order.voxel_type == "float32" ? OutputVoxelType::kFloat32 : OutputVoxelType::kSame;
    const auto file = new_result(method + ".nii.gz", "volume", method, "application/gzip");
    results_.back().frame = name_of(Frame::kRas);
    padding_.exchange(volume);
    const WriteOutcome written = write_nifti(file, volume, description_.header, type, progress);
    padding_.exchange(volume);
    if (written.clipped_voxels > 0) warn_of_clipped(written.clipped_voxels, method);
    return written;
  }

  void warn_of_clipped(std::int64_t voxels, const std::string& method) {
    warnings_.push_back("clipped-voxels: " + std::to_string(voxels) + " voxels of " + method +
                        " were outside what " + description_.voxel_type + " can hold.");
  }

  bool wanted(const std::string& output) const {
    return std::ranges::find(task_.order.outputs, output) != task_.order.outputs.end();
  }

  void write_dicom_series(const std::string& method, const Volume& volume, const Progress& progress) {
    const auto file = new_result(method + "_dicom.zip", "series", method, "application/zip");
    results_.back().frame = name_of(Frame::kLps);
    const std::int64_t clipped = dicom_.write_series(file, volume, progress);
    const bool said = wanted("nifti") && task_.order.voxel_type != "float32";
    if (clipped > 0 && !said) warn_of_clipped(clipped, method);
  }

  void write_dicom_surfaces(const std::string& method, const std::vector<Mesh>& surfaces) {
    if (surfaces.empty()) return;
    clock_.run("write", 0, [&](const Progress& progress) {
      for (const std::string format : {"stl", "obj"}) {
        if (!wanted("dicom-" + format)) continue;
        for (const Mesh& surface : surfaces) {
          make_room_for(std::span(&surface, 1), [&](std::int64_t vertices, std::int64_t triangles) {
            return most_bytes_of_dicom("dicom-" + format, vertices, triangles);
          });
          const std::string suffix = "_iso" + isovalue_text(surface.isovalue) + "_" + format + ".dcm";
          const auto file = new_dicom_result(method + suffix, method, std::span(&surface, 1));
          dicom_.write_mesh(file, format, surface, progress);
        }
      }
      if (wanted("dicom-surface-segmentation")) {
        make_room_for(surfaces, [&](std::int64_t vertices, std::int64_t triangles) {
          return most_bytes_of_dicom("dicom-surface-segmentation", vertices, triangles);
        });
        const auto file = new_dicom_result(method + "_surfaces.dcm", method, surfaces);
        results_.back().many_surfaces = true;
        dicom_.write_segmentation(file, surfaces, progress);
      }
      progress(1);
    });
  }

  std::filesystem::path new_dicom_result(const std::string& name, const std::string& method,
                                         std::span<const Mesh> surfaces) {
    const auto file = new_result(name, "dicom", method, "application/dicom");
    for (const Mesh& surface : surfaces) results_.back().isovalues.push_back(surface.isovalue);
    results_.back().frame = name_of(Frame::kLps);
    return file;
  }

  void measure_surface(const std::string& method, const Mesh& surface, std::size_t which) {
    SurfaceRow row{method, isovalues_[which], original_measures_[which], {}, {}};
    clock_.run("surfaces", kSurfaceCost / 2 * voxels_, [&](const Progress& progress) {
      row.after = measure(surface, progress);
      if (original_surfaces_[which].triangles.empty()) return;
      if (surface.triangles.empty()) {
        warnings_.push_back("no-surface: " + method + " leaves nothing at isovalue " +
                            isovalue_text(isovalues_[which]) + ", so there is no file for it.");
      } else {
        row.moved = displacement(surface, original_surfaces_[which], map_of_surfaces(), progress);
      }
    });
    surface_rows_.push_back(std::move(row));
  }

  void write_meshes(const std::string& method, const std::vector<Mesh>& surfaces) {
    for (const std::string& name : task_.order.mesh_formats) {
      const MeshFormat* format = find_mesh_format(name);
      if (format == nullptr) throw std::logic_error("order for a mesh format that is not in the table");
      const double share = method == kOriginal ? 0 : 1 / static_cast<double>(task_.order.mesh_formats.size());
      clock_.run("write", share * kMeshWriteCost * static_cast<double>(surfaces.size()) * voxels_,
                 [&](const Progress& progress) { write_meshes_as(*format, method, surfaces, progress); });
    }
  }

  void write_meshes_as(const MeshFormat& format, const std::string& method, const std::vector<Mesh>& surfaces,
                       const Progress& progress) {
    if (surfaces.empty()) return;
    std::vector<std::span<const Mesh>> files;
    if (format.many_surfaces) {
      files.emplace_back(surfaces);
    } else {
      for (const Mesh& surface : surfaces) files.emplace_back(&surface, 1);
    }
    for (const std::span<const Mesh> meshes : files) {
      make_room_for(meshes, format.most_bytes);
      std::vector<double> isovalues;
      for (const Mesh& mesh : meshes) isovalues.push_back(mesh.isovalue);
      const std::string suffix = format.many_surfaces ? "" : "_iso" + isovalue_text(isovalues.front());
      const auto file = new_result(method + suffix + "." + format.name, "surface", method, format.media_type);
      Result& result = results_.back();
      result.isovalues = std::move(isovalues);
      result.many_surfaces = format.many_surfaces;
      result.frame = name_of(meshes.front().frame);
      format.write(file, meshes, progress);
    }
  }

  /// Throws ResultsTooLarge when with a file of `meshes` the results may go beyond what is held back for
  /// them, and the disk has not room for twice as much: the rest is others'.
  void make_room_for(std::span<const Mesh> meshes,
                     const std::function<std::int64_t(std::int64_t, std::int64_t)>& most_bytes) const {
    std::int64_t needed = static_cast<std::int64_t>(parts_to_come_) * held_.beside_surfaces;
    for (const Result& result : results_)
      needed += static_cast<std::int64_t>(std::filesystem::file_size(task_.output_dir / result.name));
    for (const Mesh& mesh : meshes)
      needed += most_bytes(std::ssize(mesh.positions), std::ssize(mesh.triangles));
    const std::int64_t beyond = needed - held_.all;
    if (beyond > 0 && limits_.free_bytes(task_.output_dir) < 2 * beyond)
      throw ResultsTooLarge(needed, held_.all);
  }

  std::filesystem::path new_result(const std::string& name, const char* kind, const std::string& method,
                                   const std::string& media_type) {
    Result result;
    result.name = name;
    result.kind = kind;
    result.method = method;
    result.media_type = media_type;
    results_.push_back(std::move(result));
    return task_.output_dir / name;
  }

  void write_report() {
    const ReportTiming timing{clock_.seconds("read"), clock_.seconds("flow"), clock_.seconds("surfaces"),
                              clock_.seconds("write")};
    const auto document = report_document(task_, warnings_, foliation_rows_, surface_rows_, timing);
    const auto file = new_result("report.json", "report", task_.order.method, "application/json");
    std::ofstream out(file);
    out << document.dump(2) << '\n';
    out.close();
    if (!out) throw std::system_error(errno, std::generic_category(), "writing the report");
  }

  const ComputeTask& task_;
  const std::vector<Part> parts_;
  const PipelineLimits& limits_;
  const std::int64_t
      surface_bytes_;  ///< that one surface may take: its job holds it, the original's and a grid to search
  const ResultsSize held_;
  std::size_t parts_to_come_;  ///< that have written nothing yet
  DicomResults dicom_;
  const double voxels_;
  StageClock clock_;
  VolumeDescription description_;
  Volume::Pointer original_;
  Padding padding_;
  MiddleSlices original_slices_;
  std::vector<double> isovalues_;
  FoliationMeasures original_foliation_;
  std::vector<Mesh> original_surfaces_;
  std::vector<SurfaceMeasures> original_measures_;
  std::vector<FoliationRow> foliation_rows_;
  std::vector<SurfaceRow> surface_rows_;
  std::vector<std::string> warnings_;
  std::vector<Result> results_;
};

}  // namespace

Problem problem_of(const MeshFileTooLarge& file) {
  const auto needed = static_cast<std::int64_t>(file.needed_bytes),
             limit = static_cast<std::int64_t>(file.limit);
  return {"job-too-large",
          "The surfaces take " + gigabytes(needed) + " as a GLB file, and that format ends at " +
              gigabytes(limit) + "; use stl or ply, or fewer isovalues.",
          {{"estimate_bytes", needed}, {"limit_bytes", limit}}};
}

tl::expected<std::vector<Result>, Problem> run_job(const ComputeTask& task, const StageProgress& report,
                                                   const PipelineLimits& limits) {
  lower_thread_priority();
  restart_peak_memory();
  tl::expected<std::vector<Result>, Problem> outcome;
  try {
    with_threads(task.threads, [&] { outcome = JobRun(task, report, limits).run(); });
  } catch (const DeriveRefused& refused) {
    return tl::unexpected(refused.problem);
  } catch (const SurfaceTooLarge& surface) {
    return tl::unexpected(
        Problem{"job-too-large",
                "A surface at one of the isovalues needs " + gigabytes(surface.needed_bytes) +
                    " of memory, and this server lets one take " + gigabytes(surface.limit) +
                    "; smooth more strongly, choose another isovalue, or crop the volume.",
                {{"estimate_bytes", surface.needed_bytes}, {"limit_bytes", surface.limit}}});
  } catch (const MeshFileTooLarge& file) {
    return tl::unexpected(problem_of(file));
  } catch (const ResultsTooLarge& results) {
    return tl::unexpected(
        Problem{"insufficient-storage",
                "The surfaces are so rough that the results need " + gigabytes(results.needed_bytes) +
                    " of the disk or more, and " + gigabytes(results.limit) +
                    " is held back for them, beyond which the disk has too little; free some space, smooth "
                    "more strongly, ask for fewer formats or isovalues or for "
                    "others, or crop the volume.",
                {{"estimate_bytes", results.needed_bytes}, {"limit_bytes", results.limit}}});
  }
  return outcome;
}

}  // namespace volsmooth
