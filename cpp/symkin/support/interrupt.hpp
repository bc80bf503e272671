// SPDX-License-Identifier: MIT
#pragma once

namespace symkin {

// Long computations ask a few times a second whether to go on: the hook of the program throws if
// not, and what it throws leaves the computation. It is asked on the thread that called the
// library. Null (the default): they run to the end.
void set_interrupt_hook(void (*hook)());

// What long loops call, as often as they like.
void check_interrupt();

// For threads that the library starts itself, at their beginning: there the hook is never asked.
void leave_interrupts_to_the_caller();

}  // namespace symkin
