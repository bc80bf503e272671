// SPDX-License-Identifier: MIT
#include <symkin/chains/registry.hpp>
#include <symkin/model/leg_model_of.hpp>

int main() { return symkin::leg_model("[R]RR", symkin::Platform::rigid).info().name != "[R]RR"; }
