#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// How the density within the cells is guessed from their averages (thesis, section 4.2 and appendix A).
enum class Reconstruction {
  kPiecewiseConstant,  ///< first order, keeps the range
  kWeno7,              ///< the thesis' appendix A: four stencils of four cells with the weights of WENO-7
  kWeno5               ///< Jiang and Shu's: three stencils of three cells, a value on the face
};

/// Cell averages across a face, counted along the flow: [3] is the cell just upstream of the face, [0] the
/// third before it, [6] the third after it.
template <class Scalar>
using UpwindCells = std::array<Scalar, 7>;

/// The number that keeps the weights' denominators from 0: 1e-6, as in the thesis, for densities in [0, 1],
/// and so in proportion to `intensity_range` squared for others, by which the schemes commute with affine
/// maps. Differences of more than 1e18 have no squares in float.
template <class Scalar>
Scalar weno_epsilon(Scalar intensity_range) {
  return std::max(Scalar(1e-6) * intensity_range * intensity_range, std::numeric_limits<Scalar>::min());
}

/// The smoothness S of the cubic with these differences of its four cell averages: the squares of its three
/// derivatives integrated over the four cells, in units of the cell width (thesis, Eq. A.1; the printed
/// quadratic form as the sum of squares that it is, so that it cannot round to below 0).
template <class Scalar>
VOLSMOOTH_FORMULA Scalar cubic_smoothness(Scalar first, Scalar second, Scalar third) {
  const Scalar bend = third - first, twist = third - 2 * second + first;
  const Scalar slope = second + Scalar(7.0 / 12) * twist;
  return 4 * slope * slope + Scalar(7.0 / 3) * bend * bend + Scalar(484.0 / 45) * twist * twist;
}

/// Of the cubic with these four cell averages: its mean over the last `courant` of the cell before a face,
/// less its mean over the whole of that cell (thesis, q_0 .. q_3 of appendix A, q_2 with its sign corrected,
/// over h, less rho_x). The face lies `face` cells after the middle of the four.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar cubic_correction(Scalar first, Scalar second, Scalar third, Scalar face,
                                          Scalar courant) {
  const Scalar cubic = (third - 2 * second + first) * Scalar(1.0 / 6);
  const Scalar square = (third - first) * Scalar(0.25);
  const Scalar linear = second - Scalar(0.5) * cubic;
  const Scalar up = 1 + courant;
  return (1 - courant) *
         (Scalar(0.5) * linear + square * (face - up * Scalar(1.0 / 3)) +
          cubic * (Scalar(1.5) * face * face - face * up + Scalar(0.25) * (up + courant * courant)));
}

/// The weights of stencils by their roughness, up to a common factor: `ideal` / (roughness + epsilon)^power
/// times that of the least rough. So one of them is `ideal`, and none overflows, whatever the data.
template <int kPower, std::size_t kStencils, class Scalar>
VOLSMOOTH_FORMULA std::array<Scalar, kStencils> weno_weights(const std::array<Scalar, kStencils>& ideal,
                                                             const std::array<Scalar, kStencils>& roughness,
                                                             Scalar epsilon) {
  Scalar least = roughness[0];
  for (std::size_t i = 1; i < kStencils; ++i) least = std::min(least, roughness[i]);
  std::array<Scalar, kStencils> weights = ideal;
  for (std::size_t i = 0; i < kStencils; ++i) {
    const Scalar smooth = (least + epsilon) / (roughness[i] + epsilon);
    for (int factor = 0; factor < kPower; ++factor) weights[i] *= smooth;
  }
  return weights;
}

/// Equations A.2 and A.3, less rho_x, over h. The weights were made for the value on the face (courant = 0);
/// for other regions the scheme is still exact for cubics.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar weno7_correction(const UpwindCells<Scalar>& rho, Scalar courant, Scalar epsilon) {
  constexpr std::array<Scalar, 4> kIdeal{Scalar(1.0 / 35), Scalar(12.0 / 35), Scalar(18.0 / 35),
                                         Scalar(4.0 / 35)};
  std::array<Scalar, 4> correction, roughness;
  for (std::size_t i = 0; i < 4; ++i) {
    const Scalar first = rho[i + 1] - rho[i], second = rho[i + 2] - rho[i + 1],
                 third = rho[i + 3] - rho[i + 2];
    correction[i] = cubic_correction(first, second, third, Scalar{2} - static_cast<Scalar>(i), courant);
    roughness[i] = cubic_smoothness(first, second, third);
  }
  const auto weights = weno_weights<1>(kIdeal, roughness, epsilon);
  Scalar sum = 0, total = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    sum += weights[i] * correction[i];
    total += weights[i];
  }
  return sum / total;
}

/// The classical WENO-5 value on a face between the third and fourth of five cell averages along the flow,
/// less the third (Jiang and Shu 1996); from the four differences of the five.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar weno5_correction(const std::array<Scalar, 4>& differences, Scalar epsilon) {
  constexpr std::array<Scalar, 3> kIdeal{Scalar(0.1), Scalar(0.6), Scalar(0.3)};
  const auto& [a, b, c, d] = differences;
  const std::array<Scalar, 3> bend{b - a, c - b, d - c}, slope{3 * b - a, b + c, 3 * c - d};
  std::array<Scalar, 3> roughness;
  for (std::size_t i = 0; i < 3; ++i)
    roughness[i] = Scalar(13.0 / 12) * bend[i] * bend[i] + Scalar(0.25) * slope[i] * slope[i];
  const auto [before, across, after] = weno_weights<2>(kIdeal, roughness, epsilon);
  return (before * (5 * b - 2 * a) + across * (b + 2 * c) + after * (4 * c - d)) /
         (6 * (before + across + after));
}

/// The mean of the reconstructed density over what passes a face, which is the part `courant` = |u| dt / h
/// (0 .. 1) of the upstream cell next to it; 0 gives the value on the face. |u| dt times it is the mass that
/// passes a unit of area. Constants come out to the bit.
template <Reconstruction kScheme, class Scalar>
VOLSMOOTH_FORMULA Scalar swept_mean(const UpwindCells<Scalar>& rho, Scalar courant, Scalar epsilon) {
  if constexpr (kScheme == Reconstruction::kWeno7)
    return rho[3] + weno7_correction(rho, courant, epsilon);
  else if constexpr (kScheme == Reconstruction::kWeno5)
    return rho[3] + weno5_correction<Scalar>(
                        {rho[2] - rho[1], rho[3] - rho[2], rho[4] - rho[3], rho[5] - rho[4]}, epsilon);
  else
    return rho[3];
}

}  // namespace volsmooth
