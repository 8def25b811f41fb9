#include "tests/figures/models.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "algorithms/formats/nifti.h"
#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/otsu.h"
#include "algorithms/surface/vector_math.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

/// Signed distances in mm, negative inside; those of ellipsoids are right near their surface only.
double ball(const Vector3& x, const Vector3& centre, double radius) {
  return length(x - centre) - radius;
}

double capsule(const Vector3& x, const Vector3& from, const Vector3& to, double radius) {
  const Vector3 axis = to - from;
  const double along = std::clamp(dot(x - from, axis) / dot(axis, axis), 0.0, 1.0);
  return length(x - from - along * axis) - radius;
}

double ellipsoid(const Vector3& x, const Vector3& centre, const Vector3& half_axes) {
  Vector3 once, twice;
  for (std::size_t e = 0; e < 3; ++e) {
    once[e] = (x[e] - centre[e]) / half_axes[e];
    twice[e] = once[e] / half_axes[e];
  }
  return length(once) * (length(once) - 1) / std::max(length(twice), 1e-12);
}

/// The union of two, its seam rounded over `seam` mm.
double joined(double a, double b, double seam = 4) {
  const double near = std::max(seam - std::abs(a - b), 0.0) / seam;
  return std::min(a, b) - near * near * seam / 4;
}

double without(double a, double b) {
  return -joined(-a, b);
}

double distance_to_rabbit(const Vector3& place) {
  const Vector3 x{std::abs(place[0] - 50), place[1], place[2]};  // its right half
  double rabbit = capsule(x, {0, 40, 27}, {0, 48, 36}, 20);
  rabbit = joined(rabbit, ball(x, {0, 60, 60}, 14));
  rabbit = joined(rabbit, ball(x, {0, 73, 57}, 6));
  rabbit = joined(rabbit, ellipsoid(x, {9, 56, 80}, {6, 3.6, 17}));
  rabbit = joined(rabbit, capsule(x, {12, 46, 12}, {12, 66, 12}, 6));
  return joined(rabbit, ball(x, {0, 17, 24}, 7));
}

double distance_to_bone(const Vector3& place) {
  const Vector3 x{std::abs(place[0] - 110), place[1], place[2]};
  double bone = ellipsoid(x, {0, 100, 125}, {64, 82, 72});
  bone = joined(bone, capsule(x, {20, 146, 66}, {26, 148, 100}, 20), 10);  // face
  bone = joined(bone, capsule(x, {46, 112, 74}, {40, 118, 48}, 6));        // jaw
  bone = joined(bone, capsule(x, {40, 118, 48}, {16, 160, 36}, 6));
  bone = joined(bone, capsule(x, {0, 166, 36}, {16, 160, 36}, 7));       // chin
  bone = joined(bone, capsule(x, {60, 108, 84}, {56, 140, 84}, 3));      // cheek arch
  bone = joined(bone, capsule(x, {56, 140, 84}, {40, 158, 80}, 4));      // its front
  bone = without(bone, ellipsoid(x, {0, 100, 125}, {57, 75, 65}));       // brain
  bone = without(bone, capsule(x, {27, 172, 102}, {21, 150, 100}, 13));  // orbit
  return without(bone, capsule(x, {0, 172, 88}, {0, 162, 72}, 8));       // nose
}

double distance_to_skin(const Vector3& place) {
  const Vector3 x{std::abs(place[0] - 110), place[1], place[2]};
  double skin = ellipsoid(x, {0, 100, 125}, {72, 90, 80});
  skin = joined(skin, capsule(x, {0, 148, 50}, {0, 148, 96}, 36), 20);
  skin = joined(skin, capsule(x, {0, 187, 70}, {0, 182, 92}, 8), 8);
  skin = joined(skin, ellipsoid(x, {74, 98, 100}, {7, 12, 22}));
  return joined(skin, capsule(x, {0, 92, 0}, {0, 92, 60}, 44), 20);
}

/// Inside (the voxel is 1) and outside of a surface, blurred over a voxel or so.
double part_inside(double distance, double width) {
  return (1 - std::tanh(distance / width)) / 2;
}

Grid cube(std::int64_t cells, double side_mm) {
  const double h = side_mm / static_cast<double>(cells);
  return {{cells, cells, cells}, {h, h, h}};
}

Scan head_of(const FigureOrder& order) {
  auto loaded = read_nifti(*order.head, {});
  if (!loaded) throw std::runtime_error("cannot read " + order.head->string());
  return {"head", loaded->volume, loaded->description.map, otsu_threshold(*loaded->volume), order.isovalue};
}

}  // namespace

Volume::Pointer rabbit(std::int64_t cells) {
  const Grid grid = cube(cells, 120);
  const double h = grid.spacing_mm[0];
  return volume_of(grid, sampled(grid, [&](const Vector3& x) {
                     const Vector3 middle = x + Vector3{h / 2 - 10, h / 2 - 10, h / 2 - 10};
                     return part_inside(distance_to_rabbit(middle), 1.5 * h);
                   }));
}

Scan head_phantom(std::int64_t cells) {
  constexpr double kAir = -1000, kSoft = 40, kBone = 1200, kBumps = 1.2;
  const Grid grid = cube(cells, 220);
  const double h = grid.spacing_mm[0];
  auto volume = volume_of(grid, sampled(grid, [&](const Vector3& x) {
                            double bumps = kBumps;
                            for (const double place : x) bumps *= std::sin(place / 2.5);
                            return kAir + (kSoft - kAir) * part_inside(distance_to_skin(x) + bumps, h) +
                                   (kBone - kSoft) * part_inside(distance_to_bone(x), h);
                          }));
  const auto added = noise(grid.size, 1, -200, 200);
  std::ranges::transform(voxels_of(*volume), added, voxels_of(*volume).begin(), std::plus{});
  return {"phantom", volume, {.linear = steps_of(grid)}, -500, 400};
}

std::vector<Scan> scans(const FigureOrder& order) {
  std::vector<Scan> all{head_phantom(order.cells(128, 80))};
  if (order.head) all.push_back(head_of(order));
  return all;
}

Mesh surface_of(const Volume& volume, double isovalue) {
  return extract_isosurface(volume, {.linear = steps_of(grid_of(volume))}, isovalue);
}

}  // namespace volsmooth
