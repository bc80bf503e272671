// SPDX-License-Identifier: MIT

// Diagnosis of the residuals of robots with many legs: planar [R]RR legs about a circle, 24 poses a
// leg. Processor time of one thread.

#include <benchmark/benchmark.h>

#include <string>

#include "support/mechanisms.hpp"
#include "symkin/estimation/diagnosis.hpp"
#include "symkin/estimation/simulation.hpp"

namespace symkin::testing {
namespace {

Mechanism robot_of(Index legs) {
  const ChainModel& model = leg_model("[R]RR");
  const SymmetryGroup group = SymmetryGroup::named("C" + std::to_string(legs));
  const Leg reference = paper_3rrr().leg(0);
  return {"many legs", model,
          generate_legs(group, model, reference, generating_elements(group, legs))};
}

void diagnosis(benchmark::State& state) {
  constexpr double kAlarm = 5e-4;
  const Index legs = state.range(0);
  const Index count = 24 * legs;
  const MeasurementNoise noise{1e-4, 1e-4, 5e-5};
  const Mechanism nominal = robot_of(legs);
  const RowMatrix poses = sample_workspace(nominal, paper_workspace(), count + 20, 3).poses;
  const Mechanism actual = disturb(nominal, {1e-3, 1e-3, 1e-3}, 7);
  const MeasurementSet measured =
      simulate(actual, nominal, {{-1, poses, count}}, noise, 5).measurements;
  for (auto run : state) {
    benchmark::DoNotOptimize(diagnose(actual, measured, noise, {}, true, kAlarm));
  }
}
BENCHMARK(diagnosis)->Arg(6)->Arg(12)->Arg(24)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace symkin::testing
