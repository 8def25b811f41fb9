#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <map>
#include <string>
#include <vector>

namespace volsmooth {

template <class Work>
double seconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Of all threads: on a shared machine the clock on the wall tells of others.
template <class Work>
double processor_seconds(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// What was measured in each round. Contestants take turns within a round, and ratios are taken there:
/// machines differ and are shared, ratios hold.
class Rounds {
 public:
  void add(const std::string& name, double value) { values_[name].push_back(value); }

  /// The medians over the rounds, as counters.
  void report(benchmark::State& state) {
    for (auto& [name, values] : values_) {
      const auto middle = values.begin() + std::ssize(values) / 2;
      std::ranges::nth_element(values, middle);
      state.counters[name] = *middle;
    }
  }

 private:
  std::map<std::string, std::vector<double>> values_;
};

}  // namespace volsmooth
