// SPDX-License-Identifier: MIT
#include "symkin/selection/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace symkin {

int thread_count(int asked) {
  return asked > 0 ? asked : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_for(Index tasks, int threads, const std::function<void(Index)>& task) {
  const Index workers = std::min<Index>(thread_count(threads), tasks);
  if (workers <= 1) {
    for (Index i = 0; i < tasks; ++i) {
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
        task(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(guard);
        if (i < failed) {
          failed = i;
          failure = std::current_exception();
        }
      }
    }
  };
  std::vector<std::thread> others;
  for (Index i = 1; i < workers; ++i) {
    others.emplace_back(work);
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
