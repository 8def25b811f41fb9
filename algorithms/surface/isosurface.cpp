#include "algorithms/surface/isosurface.h"

#include <limits>
#include <string>

#include "algorithms/surface/cell_cases.h"
#include "algorithms/surface/cut_rows.h"
#include "algorithms/surface/serial_for.h"
#include "algorithms/surface/vertex_geometry.h"
#include "algorithms/surface/vertex_numbers.h"
#include "algorithms/volume/parallel.h"

// Marching cubes by rows, after "Flying Edges" (Schroeder, Maynard, Geveci, LDAV 2015): count the vertices
// and the triangles of every row, sum up, then write all rows at once, each knowing where its own go.

namespace volsmooth {
namespace {

constexpr std::int64_t kRowsPerChunk = 64;

/// The rows of cells of a surface: those of the volume, and one row more on all sides when it is closed.
class CellRows {
 public:
  explicit CellRows(const CutRows& cut)
      : first_(cut.closed() ? -1 : 0),
        rows_(cut.size()[1] - 1 - 2 * first_),
        planes_(cut.size()[2] - 1 - 2 * first_) {}

  std::int64_t count() const { return rows_ * planes_; }

  /// Calls `body(number, y, z)` for all of them, in parallel.
  template <typename Body>
  void for_each(const Body& body, const Progress& report) const {
    parallel_for(
        count(), kRowsPerChunk,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t r = begin; r < end; ++r) {
            body(static_cast<std::size_t>(r), first_ + r % rows_, first_ + r / rows_);
          }
        },
        report);
  }

 private:
  std::int64_t first_, rows_, planes_;
};

/// Element r is the number of triangles before row r; the last one is that of all triangles.
std::vector<std::int64_t> first_triangles(const CutRows& cut, const CellRows& rows, const Progress& report) {
  const auto& cases = cell_cases();
  std::vector<std::int64_t> first(static_cast<std::size_t>(rows.count()) + 1);
  rows.for_each(
      [&](std::size_t r, std::int64_t y, std::int64_t z) {
        cut.for_each_cut_cell(
            y, z, [&](std::int64_t, unsigned corners) { first[r + 1] += cases[corners].triangle_count; });
      },
      report);
  for (std::size_t r = 1; r < first.size(); ++r) first[r] += first[r - 1];
  return first;
}

/// Throws when the mesh is beyond its numbers or its limit of memory.
void check_size(std::int64_t vertices, std::int64_t triangles, std::int64_t max_bytes) {
  if (triangles > std::numeric_limits<std::uint32_t>::max()) {
    throw std::length_error("an isosurface of more than 2^32 - 1 triangles");
  }
  constexpr std::int64_t kPerVertex = 2 * sizeof(Float3) + sizeof(float);
  constexpr std::int64_t kPerTriangle = sizeof(Triangle) + sizeof(std::uint8_t);
  const std::int64_t needed = kPerVertex * vertices + kPerTriangle * triangles;
  if (max_bytes > 0 && needed > max_bytes) throw SurfaceTooLarge(needed, max_bytes);
}

/// `flip`: voxel indices are left-handed in the world, so the other order is counter-clockwise there.
void write_triangles(const VertexNumbers& numbers, const CellRows& rows,
                     const std::vector<std::int64_t>& first, bool flip, Mesh& mesh, const Progress& report) {
  const CutRows& cut = numbers.cut();
  grow(mesh.triangles, static_cast<std::size_t>(first.back()), part_of(report, 0, 0.3));
  grow(mesh.triangle_on_cap, mesh.triangles.size(), part_of(report, 0.3, 0.4));

  const auto& cases = cell_cases();
  rows.for_each(
      [&](std::size_t r, std::int64_t y, std::int64_t z) {
        if (first[r] == first[r + 1]) return;
        const bool beyond = !cut.is_row(y, z) || !cut.is_row(y + 1, z + 1);
        auto next = static_cast<std::size_t>(first[r]);
        VertexCursor cursor(numbers, y, z);
        cut.for_each_cut_cell(y, z, [&](std::int64_t place, unsigned corners) {
          const auto vertices = cursor.of_cell(place, corners);
          const bool on_cap = beyond || place == 0 || place == cut.size()[0];
          for (const auto& [a, b, c] : cases[corners].triangles()) {
            mesh.triangles[next] = {vertices[a], vertices[flip ? c : b], vertices[flip ? b : c]};
            mesh.triangle_on_cap[next++] = on_cap ? 1 : 0;
          }
        });
      },
      part_of(report, 0.4, 1));
}

/// Writes the vertices of a mesh, those that can wait together in packets.
class VertexWriter {
 public:
  VertexWriter(const VertexGeometry& geometry, Mesh& mesh)
      : geometry_(geometry), mesh_(mesh), packet_(geometry.empty_packet()) {}

  void write_on_edge(std::size_t vertex, const Size3& voxel, std::size_t axis) {
    if (!geometry_.fits_packet(voxel, axis)) return write(vertex, geometry_.on_edge(voxel, axis));
    geometry_.fill(packet_, waiting_, voxel, axis);
    vertices_[waiting_++] = vertex;
    if (waiting_ == vertices_.size()) finish();
  }

  void write(std::size_t vertex, const SurfaceVertex& what) {
    mesh_.positions[vertex] = what.position;
    mesh_.normals[vertex] = what.normal;
    mesh_.curvatures[vertex] = what.curvature;
  }

  /// Writes those that still wait.
  void finish() {
    static const auto complete = vertex_packet_kernel(instruction_sets().back());
    complete({&packet_});
    for (std::size_t p = 0; p < waiting_; ++p) {
      const auto& [x, y, z] = packet_.position;
      const auto& [nx, ny, nz] = packet_.normal;
      write(vertices_[p], {{x[p], y[p], z[p]}, {nx[p], ny[p], nz[p]}, packet_.curvature[p]});
    }
    waiting_ = 0;
  }

 private:
  const VertexGeometry& geometry_;
  Mesh& mesh_;
  VertexPacket packet_;
  std::array<std::size_t, VertexPacket::kVertices> vertices_{};
  std::size_t waiting_ = 0;
};

void write_vertices(const VertexNumbers& numbers, const VertexGeometry& geometry, Mesh& mesh,
                    const Progress& report) {
  const CutRows& cut = numbers.cut();
  grow(mesh.positions, numbers.count(), part_of(report, 0, 0.05));
  grow(mesh.normals, numbers.count(), part_of(report, 0.05, 0.1));
  grow(mesh.curvatures, numbers.count(), part_of(report, 0.1, 0.12));
  const auto write_row = [&](std::int64_t y, std::int64_t z, VertexWriter& writer) {
    std::size_t next = numbers.row(y, z).on_edges[0];
    const auto for_each_bit = [](std::uint64_t bits, std::int64_t word, const auto& visit) {
      for (; bits != 0; bits &= bits - 1) visit(64 * word + std::countr_zero(bits) - 1);
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::int64_t word = 0; word < cut.words(); ++word) {
        for_each_bit(cut.cut_edges(y, z, axis, word), word, [&](std::int64_t x) {
          writer.write_on_edge(next++, {x, y, z}, axis);
        });
      }
    }
    for (std::int64_t word = 0; word < cut.words(); ++word) {
      for_each_bit(cut.border_voxels(y, z, word), word, [&](std::int64_t x) {
        writer.write(next++, geometry.on_border({x, y, z}));
      });
    }
  };
  const std::int64_t rows = cut.size()[1];
  parallel_for(
      rows * cut.size()[2], kRowsPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        VertexWriter writer(geometry, mesh);
        for (std::int64_t r = begin; r < end; ++r) write_row(r % rows, r / rows, writer);
        writer.finish();
      },
      part_of(report, 0.12, 1));
}

}  // namespace

SurfaceTooLarge::SurfaceTooLarge(std::int64_t needed, std::int64_t allowed)
    : std::length_error("an isosurface of " + std::to_string(needed) + " bytes, beyond the limit of " +
                        std::to_string(allowed)),
      needed_bytes(needed),
      limit(allowed) {}

Mesh extract_isosurface(const Volume& volume, const VoxelToWorld& map, double isovalue,
                        const IsosurfaceOptions& options, const Progress& report) {
  Mesh mesh;
  mesh.frame = map.frame;
  mesh.isovalue = isovalue;
  for (std::int64_t n : grid_of(volume).size) {
    if (n < 2) return mesh;
  }
  const CutRows cut(volume, isovalue, options.closed, part_of(report, 0, 0.2));
  const VertexNumbers numbers(cut, part_of(report, 0.2, 0.3));
  const CellRows rows(cut);
  const auto first = first_triangles(cut, rows, part_of(report, 0.3, 0.4));
  check_size(numbers.count(), first.back(), options.max_bytes);
  write_triangles(numbers, rows, first, determinant(map.linear) < 0, mesh, part_of(report, 0.4, 0.5));
  write_vertices(numbers, VertexGeometry(volume, map, isovalue), mesh, part_of(report, 0.5, 1));
  return mesh;
}

}  // namespace volsmooth
