// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include "symkin/support/types.hpp"

namespace symkin {

// As asked, or the machine's for 0.
int thread_count(int asked);

// task(0) ... task(tasks - 1), on several threads in any order. What the tasks compute must not
// depend on the thread. Where fewer threads can start, these do all. An exception is passed on:
// that of the first task that threw one.
void parallel_for(Index tasks, int threads, const std::function<void(Index)>& task);

}  // namespace symkin
