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
/// maps. In float for ranges below 1e18.
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

/// Equations A.2 and A.3, less rho_x, over h. The weights were made for the value on the face (courant = 0);
/// for other regions the scheme is still exact for cubics.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar weno7_correction(const UpwindCells<Scalar>& rho, Scalar courant, Scalar epsilon) {
  constexpr std::array<Scalar, 4> kWeights{Scalar(1.0 / 35), Scalar(12.0 / 35), Scalar(18.0 / 35),
                                           Scalar(4.0 / 35)};
  Scalar sum = 0, weights = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Scalar first = rho[i + 1] - rho[i], second = rho[i + 2] - rho[i + 1],
                 third = rho[i + 3] - rho[i + 2];
    const Scalar weight = kWeights[i] * (epsilon / (cubic_smoothness(first, second, third) + epsilon));
    sum += weight * cubic_correction(first, second, third, Scalar{2} - static_cast<Scalar>(i), courant);
    weights += weight;
  }
  return sum / weights;
}

/// The classical WENO-5 value on a face between [2] and [3] of five cell averages along the flow, the third
/// of them upstream, less that one (Jiang and Shu 1996). The differences of the five suffice.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar weno5_correction(const std::array<Scalar, 4>& difference, Scalar epsilon) {
  const auto& [a, b, c, d] = difference;
  const auto weight = [epsilon](Scalar ideal, Scalar bend, Scalar slope) {
    const Scalar roughness = Scalar(13.0 / 12) * bend * bend + Scalar(0.25) * slope * slope;
    const Scalar smooth = epsilon / (roughness + epsilon);
    return ideal * smooth * smooth;
  };
  const Scalar before = weight(Scalar(0.1), b - a, 3 * b - a);
  const Scalar across = weight(Scalar(0.6), c - b, b + c);
  const Scalar after = weight(Scalar(0.3), d - c, 3 * c - d);
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
