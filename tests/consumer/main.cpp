// SPDX-License-Identifier: MIT
#include <symkin/chains/rrr.hpp>
#include <symkin/model/leg_model_of.hpp>
#include <symkin/symkin.hpp>

int main() {
  const symkin::LegModelOf<symkin::RrrActive1> own;
  return own.info().name != symkin::leg_model("[R]RR", symkin::Platform::rigid).info().name;
}
