#include "service/jobs/commit_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>

namespace volsmooth {
namespace {

using Steps = std::span<CommitQueue::Step* const>;

/// Carries them out, alone failing ones apart, and notes how many there were.
class CommitQueueTest : public testing::Test {
 protected:
  void commit(Steps steps) {
    ++commits_;
    for (CommitQueue::Step* step : steps) try {
        step->work();
      } catch (...) {
        step->failure = std::current_exception();
      }
    if (broken_) throw std::runtime_error("the disk is gone");
  }

  /// Holds up the queue's thread until so many others wait.
  void hold_up_until(int waiting) {
    queue_.run([this, waiting] {
      for (int i = 0; i < waiting; ++i)
        others_.emplace_back([this] {
          ++arriving_;
          queue_.run([this] { ++done_; });
        });
      while (arriving_ < waiting) std::this_thread::yield();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));  // they are on their way into the queue
    });
    for (std::thread& other : others_) other.join();
  }

  int commits_ = 0;
  bool broken_ = false;
  std::atomic<int> arriving_ = 0, done_ = 0;
  std::vector<std::thread> others_;
  CommitQueue queue_{[this](Steps steps) { commit(steps); }};
};

TEST_F(CommitQueueTest, WhatComesDuringACommitSharesTheNext) {
  hold_up_until(5);
  EXPECT_EQ(done_, 5);
  EXPECT_LE(commits_, 3);  // by itself, 6
}

TEST_F(CommitQueueTest, AFailureIsItsOwn) {
  EXPECT_THROW(queue_.run([] { throw std::logic_error("no"); }), std::logic_error);
  queue_.run([this] { ++done_; });
  EXPECT_EQ(done_, 1);
}

TEST_F(CommitQueueTest, WhatCannotBeCommittedFailsForAll) {
  broken_ = true;
  EXPECT_THROW(queue_.run([] {}), std::runtime_error);
  EXPECT_THROW(queue_.run([] { throw std::logic_error("no"); }), std::logic_error);
}

TEST_F(CommitQueueTest, KnowsForWhomAStepIs) {
  Actor seen;
  const ActingFor someone({"ward", "token", "request"});
  CommitQueue queue([&](Steps steps) { seen = steps.front()->actor; });
  queue.run([] {});
  EXPECT_EQ(seen.token, "token");
}

TEST_F(CommitQueueTest, RunsBetweenCommits) {
  queue_.run_between([this] { ++done_; });
  EXPECT_EQ(done_, 1);
  EXPECT_EQ(commits_, 0);
  EXPECT_THROW(queue_.run_between([] { throw std::logic_error("no"); }), std::logic_error);
}

}  // namespace
}  // namespace volsmooth
