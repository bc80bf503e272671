// SPDX-License-Identifier: MIT
#include "symkin/support/interrupt.hpp"

#include <atomic>
#include <chrono>

namespace symkin {
namespace {

constexpr std::chrono::milliseconds kPause{100};

std::atomic<void (*)()> interrupt_hook{nullptr};
thread_local bool of_the_caller = true;

}  // namespace

void set_interrupt_hook(void (*hook)()) { interrupt_hook = hook; }

void check_interrupt() {
  void (*const hook)() = interrupt_hook;
  if (hook == nullptr || !of_the_caller) {
    return;
  }
  thread_local std::chrono::steady_clock::time_point asked;
  const auto now = std::chrono::steady_clock::now();
  if (now - asked >= kPause) {
    asked = now;
    hook();
  }
}

void leave_interrupts_to_the_caller() { of_the_caller = false; }

}  // namespace symkin
