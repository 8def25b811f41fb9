#pragma once

#include <array>
#include <cstdint>

#include "algorithms/numerics/weno.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// A row of faces and what passes them in one step.
template <class Scalar>
struct FluxRow {
  std::int64_t count;
  std::array<const Scalar*, 8> rho;  ///< rows of cells: the fourth before a face .. the fourth after it
  const Scalar* velocity;
  Scalar courant_per_velocity;  ///< dt / h
  Scalar epsilon;               ///< `weno_epsilon`
  Scalar* flux;  ///< out: what the density of the cell after the face gains, of the one before loses
};

template <class Scalar>
using FluxKernel = void (*)(const FluxRow<Scalar>&);

/// The fluxes u dt/h rho_face along a row, for float and double.
template <class Scalar>
FluxKernel<Scalar> flux_kernel(Reconstruction scheme, InstructionSet set);

}  // namespace volsmooth
