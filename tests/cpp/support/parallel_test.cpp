// SPDX-License-Identifier: MIT
#include "symkin/support/parallel.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <thread>

#include "support/mechanisms.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin {
namespace {

// While it lives no thread can start: none gets a stack of 64 TB.
class NoMoreThreads {
 public:
  NoMoreThreads() {
    pthread_getattr_default_np(&before_);
    pthread_attr_t attributes = before_;
    pthread_attr_setstacksize(&attributes, std::size_t{1} << 46U);
    pthread_setattr_default_np(&attributes);
  }
  ~NoMoreThreads() { pthread_setattr_default_np(&before_); }
  NoMoreThreads(const NoMoreThreads&) = delete;
  NoMoreThreads& operator=(const NoMoreThreads&) = delete;

 private:
  pthread_attr_t before_;
};

class Stopped : public std::exception {};
void stop() { throw Stopped(); }

struct Stopping {
  Stopping() { set_interrupt_hook(&stop); }
  ~Stopping() { set_interrupt_hook(nullptr); }
  Stopping(const Stopping&) = delete;
  Stopping& operator=(const Stopping&) = delete;
};

TEST(ParallelFor, DoesAllTasksWhereNoThreadCanStart) {
  const NoMoreThreads none;
  ASSERT_THROW(std::thread([] {}), std::system_error);
  std::atomic<int> done{0};
  parallel_for(100, 8, [&](Index) { ++done; });
  EXPECT_EQ(done, 100);
}

TEST(ParallelFor, PassesOnTheFirstFailureAndBeginsNoFurtherTask) {
  for (const int threads : {1, 2, 8}) {
    std::atomic<int> begun{0};
    try {
      parallel_for(1'000'000, threads, [&](Index i) {
        ++begun;
        throw std::out_of_range(std::to_string(i));
      });
      FAIL();
    } catch (const std::out_of_range& error) {
      EXPECT_STREQ(error.what(), "0");
    }
    EXPECT_LT(begun, 1000) << threads;
  }
}

TEST(ParallelFor, PassesOnTheFailureOfTheFirstTaskEvenIfALaterOneFailsBefore) {
  std::atomic<bool> later{false};
  try {
    parallel_for(2, 2, [&](Index i) {
      if (i == 1) {
        later = true;
        throw std::out_of_range("1");
      }
      const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
      while (!later && std::chrono::steady_clock::now() < end) {
        std::this_thread::yield();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));  // until that one is caught
      throw std::out_of_range("0");
    });
    FAIL();
  } catch (const std::out_of_range& error) {
    EXPECT_STREQ(error.what(), "0");
  }
}

TEST(Interrupt, LeavesLongComputationsByTheExceptionOfItsHook) {
  const Mechanism mechanism = testing::paper_3rrr();
  const Stopping stopping;
  EXPECT_THROW(sample_workspace(mechanism, testing::paper_workspace(), 1'000'000, 1), Stopped);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  EXPECT_THROW(parallel_for(100, 4, [](Index) {}), Stopped);
}

std::atomic<int> asked_elsewhere{0};
std::thread::id caller;
void count_threads() { asked_elsewhere += std::this_thread::get_id() == caller ? 0 : 1; }

TEST(Interrupt, IsAskedForOnTheThreadOfTheCallerAlone) {
  caller = std::this_thread::get_id();
  set_interrupt_hook(&count_threads);
  parallel_for(16, 4, [](Index) {
    check_interrupt();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  });
  set_interrupt_hook(nullptr);
  EXPECT_EQ(asked_elsewhere, 0);
}

}  // namespace
}  // namespace symkin
