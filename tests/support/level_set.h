#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace volsmooth {

/// What the thesis compares the density with (Figs. 4.2 and 6.3): the level set method in the plane, with
/// schemes of the same order. WENO-5 for Hamilton-Jacobi equations (Jiang and Peng 2000), Heun steps, and a
/// redistancing that leaves the curve where it is to fourth order, so that it is no straw man.

/// Values at the centres of `size` square cells that start at the origin, x fastest.
struct PlaneField {
  std::array<std::int64_t, 2> size{};
  double spacing = 1;
  std::vector<double> values;
};

using PlaneFunction = std::function<double(double x, double y)>;
using PlaneVelocity = std::function<std::array<double, 2>(double x, double y)>;

PlaneField sampled_in_plane(const std::array<std::int64_t, 2>& size, double spacing,
                            const PlaneFunction& function);

/// The area in which a field, interpolated between cell centres, is above `isovalue`. Of a level set phi,
/// negative inside, the enclosed area is that of -phi above 0: `enclosed_area`.
double area_above(const PlaneField& field, double isovalue);
double enclosed_area(const PlaneField& phi);

/// d phi / dt + u . grad phi = 0 for `duration`, with velocities that do not change, in steps of a Courant
/// number of 0.3 at most, as `advect` takes.
void advect_level_set(PlaneField& phi, const PlaneVelocity& velocity, double duration);

/// d phi / dt = kappa |grad phi| by central differences, in explicit steps of at most 0.2 h^2, redistanced
/// after every `steps_between_redistancing` of them, 0: never.
void flow_by_curvature(PlaneField& phi, double duration, int steps_between_redistancing = 0);

/// Makes phi the signed distance to its zero set, some 20 cells far. Beside the curve it is the distance to
/// the zero set of the bicubic interpolant (Chopp 2001), which then stays; beyond, |grad phi| = 1 is relaxed
/// to.
void redistance(PlaneField& phi);

}  // namespace volsmooth
