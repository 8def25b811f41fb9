#include "algorithms/flows/long_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// Noise is gone after a few explicit steps; long ones would have to be short as long as it is there.
constexpr std::int64_t kFirstSteps = 5;
/// The first long step stands for as many, in five stages.
constexpr std::int64_t kFirstLength = 9;
/// Fewer than these are taken one by one: a long step would save nothing.
constexpr std::int64_t kLeastLength = 6;
constexpr int kMostStages = 40;

/// One run. Where the flow is, and where an explicit step would bring it, are always known.
class Run {
 public:
  Run(Volume& volume, std::int64_t steps, double tolerance, const StagedFlow& flow, const Progress& report)
      : volume_(volume),
        steps_(steps),
        tolerance_(tolerance),
        flow_(flow),
        report_(report),
        range_(intensity_ends(voxels_of(volume), report)) {
    buffers_[0] = volume.GetPixelContainer();
    for (std::size_t more = 1; more < buffers_.size(); ++more)
      buffers_[more] = buffer_of(buffers_[0]->Size());
    for (int stages = LongStep::kLeastStages; stages <= kMostStages; ++stages)
      most_steps_.push_back(static_cast<std::int64_t>(LongStep::most_steps(stages, flow.stiffness)));
  }

  StepsTaken finish() {
    explicit_steps(std::min(steps_, kFirstSteps));
    std::int64_t length = kFirstLength, short_stretch = kLeastLength;
    while (done_ < steps_) {
      length = fitted(length);
      if (length < kLeastLength) {
        explicit_steps(std::min(short_stretch, steps_ - done_));
        short_stretch *= 2;  // so that vain attempts cost little beside them
        length = kLeastLength;
        continue;
      }
      const double error = long_step(length);
      const bool accepted = error <= tolerance_;
      if (accepted) accept(length, error);
      length = next_length(length, error, accepted);
    }
    volume_.SetPixelContainer(buffers_[0]);
    report_(1);
    return taken_;
  }

 private:
  std::span<float> span(std::size_t buffer) {
    return {buffers_[buffer]->GetBufferPointer(), buffers_[buffer]->Size()};
  }

  /// Progress of a pass that leads from one number of steps to another; it does not go back after a rejected
  /// step.
  Progress part(double from, double to) {
    const double all = static_cast<double>(steps_), begin = std::max(reported_, from / all);
    reported_ = std::max(reported_, to / all);
    return part_of(report_, begin, reported_);
  }

  void explicit_steps(std::int64_t count) {
    for (; count > 0; --count, ++done_, ++taken_.explicit_steps) {
      if (!moved_known_) move(done_);
      std::swap(buffers_[0], buffers_[1]);
      moved_known_ = false;
    }
  }

  void move(std::int64_t from) {
    flow_.step(span(0), span(1), part(static_cast<double>(from), static_cast<double>(from + 1)));
    ++taken_.evaluations;
    moved_known_ = true;
  }

  /// No longer than asked for, than what is left, or than what stages can stand for; and where little would
  /// be left, half of it.
  std::int64_t fitted(std::int64_t length) const {
    const std::int64_t left = steps_ - done_;
    const bool leaves_little = length < left && 5 * length > 3 * left;
    if (leaves_little && length >= kLeastLength) length = std::max((left + 1) / 2, kLeastLength);
    return std::min({length, left, most_steps_.back()});
  }

  /// From buffer 0, with its explicit step in 1, to `result_`, whose explicit step is the other of 2 and 3.
  double long_step(std::int64_t length) {
    if (!moved_known_) move(done_);
    const auto stages = LongStep::kLeastStages +
                        static_cast<int>(std::ranges::lower_bound(most_steps_, length) - most_steps_.begin());
    const LongStep step(stages, static_cast<double>(length));
    const auto progress = [&, from = static_cast<double>(done_)](int pass) {
      const double passes = stages + 1, all = static_cast<double>(length);
      return part(from + all * (pass - 1) / passes, from + all * pass / passes);
    };
    first_stage(step.weights(1), progress(1));
    std::size_t before = 0, previous = 2, to = 3;
    for (int stage = 2; stage <= stages; ++stage) {
      flow_.stage(
          {weights_in_float(step.weights(stage)), span(0), span(1), span(before), span(previous), range_},
          span(to), progress(stage));
      before = std::exchange(previous, to);
      to = 5 - to;
    }
    taken_.evaluations += stages;  // the judge's among them, the first not: that knows its explicit step
    result_ = previous;
    return flow_.judge({step.error_weights(), span(0), span(1), span(result_)}, span(5 - result_),
                       progress(stages + 1));
  }

  /// Between the start and its explicit step: to buffer 2.
  void first_stage(const StageWeights<double>& weights, const Progress& progress) {
    const auto [start, moved] =
        std::pair(static_cast<float>(weights.start), static_cast<float>(weights.start_moved));
    parallel_for(
        std::ssize(span(0)), 1 << 18,
        [&](std::int64_t begin, std::int64_t end) {
          const float *from = span(0).data(), *to_there = span(1).data();
          float* to = span(2).data();
          for (std::int64_t voxel = begin; voxel < end; ++voxel)
            to[voxel] = std::min(std::max(start * from[voxel] + moved * to_there[voxel], range_.lowest),
                                 range_.highest);
        },
        progress);
  }

  static StageWeights<float> weights_in_float(const StageWeights<double>& w) {
    return {static_cast<float>(w.start), static_cast<float>(w.start_moved), static_cast<float>(w.before),
            static_cast<float>(w.previous), static_cast<float>(w.previous_moved)};
  }

  void accept(std::int64_t length, double error) {
    if (result_ == 3) std::swap(buffers_[2], buffers_[3]);
    std::swap(buffers_[0], buffers_[2]);
    std::swap(buffers_[1], buffers_[3]);
    done_ += length;
    ++taken_.long_steps;
    taken_.displacement_voxels += error;
  }

  /// The error grows with the third power of the length.
  std::int64_t next_length(std::int64_t length, double error, bool accepted) {
    constexpr double kSafety = 0.8, kLeast = 0.2, kMostAtFirst = 10, kMost = 4;
    const double most = accepted ? (taken_.long_steps == 1 ? kMostAtFirst : kMost) : kSafety;
    const double factor = error > 0 ? kSafety * std::cbrt(tolerance_ / error) : most;
    if (!accepted) ++taken_.rejected;
    return static_cast<std::int64_t>(static_cast<double>(length) * std::clamp(factor, kLeast, most));
  }

  Volume& volume_;
  std::int64_t steps_;
  double tolerance_;
  const StagedFlow& flow_;
  const Progress& report_;
  IntensityEnds range_;
  std::array<Buffer, 1 + kVolumesOfLongSteps>
      buffers_;  ///< rho, an explicit step further, and two for stages
  std::vector<std::int64_t> most_steps_;
  std::int64_t done_ = 0;
  bool moved_known_ = false;
  std::size_t result_ = 2;
  double reported_ = 0;
  StepsTaken taken_;
};

}  // namespace

StepsTaken take_long_steps(Volume& volume, std::int64_t steps, double tolerance_voxels,
                           const StagedFlow& flow, const Progress& report) {
  StepsTaken taken;
  scaled_safely(volume, report, [&] { taken = Run(volume, steps, tolerance_voxels, flow, report).finish(); });
  return taken;
}

}  // namespace volsmooth
