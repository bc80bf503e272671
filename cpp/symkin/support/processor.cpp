// SPDX-License-Identifier: MIT
#include "symkin/support/processor.hpp"

namespace symkin {

Processor processor() {
#if defined(__x86_64__) && defined(__GNUC__)
  if (__builtin_cpu_supports("avx2") != 0) {
    return __builtin_cpu_supports("avx512f") != 0 ? Processor::avx512 : Processor::avx2;
  }
#endif
  return Processor::any;
}

}  // namespace symkin
