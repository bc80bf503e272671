// SPDX-License-Identifier: MIT
#include "symkin/support/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "symkin/support/interrupt.hpp"

namespace symkin {

int thread_count(int asked) {
  return asked > 0 ? asked : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_for(Index tasks, int threads, const std::function<void(Index)>& task) {
  check_interrupt();  // the others may leave no task to this thread
  const Index workers = std::min<Index>(thread_count(threads), tasks);
  if (workers <= 1) {
    for (Index i = 0; i < tasks; ++i) {
      check_interrupt();
      task(i);
    }
    return;
  }
  std::atomic<Index> next{0};
  std::mutex guard;
  std::exception_ptr failure;
  Index failed = tasks;
  const auto work = [&] {
    for (Index i = next++; i < tasks; i = next++) {
      try {
        check_interrupt();
        task(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(guard);
        if (i < failed) {
          failed = i;
          failure = std::current_exception();
        }
        next = tasks;  // those before it have begun
      }
    }
  };
  std::vector<std::thread> others;
  try {
    others.reserve(static_cast<std::size_t>(workers - 1));
    for (Index i = 1; i < workers; ++i) {
      others.emplace_back([&work] {
        leave_interrupts_to_the_caller();
        work();
      });
    }
  } catch (const std::system_error&) {
    // The machine gives no more threads: those that started do the work.
  }
  work();
  for (std::thread& thread : others) {
    thread.join();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

}  // namespace symkin
