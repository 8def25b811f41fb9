#pragma once

#include <exception>
#include <utility>

#include "service/jobs/problem.h"

namespace volsmooth {

/// Thrown within a transaction that may not stand: what it did is undone, and the caller gets the problem.
class Refused : public std::exception {
 public:
  explicit Refused(Problem why) : problem(std::move(why)) {}
  const char* what() const noexcept override { return problem.slug.c_str(); }

  Problem problem;
};

}  // namespace volsmooth
