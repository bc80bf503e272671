// SPDX-License-Identifier: MIT

// The kernels of every chain, one thread: rows (closures with all their derivatives) of a leg at
// random poses, and forward kinematics of two robots. The column `pose` is the time of one.

#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "support/mechanisms.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/support/random.hpp"

namespace symkin::testing {
namespace {

constexpr Index kPoses = 4096;

benchmark::Counter per_pose() {
  return {static_cast<double>(kPoses),
          benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert};
}

void rows(benchmark::State& state, const ChainModel& model) {
  Random random(1);
  const auto fill = [&](auto& values) {
    for (Index i = 0; i < values.size(); ++i) {
      values.data()[i] = 0.5 + random.uniform();
    }
  };
  Vector parameters(model.parameter_count());
  Vector readings(kPoses);
  RowMatrix poses(kPoses, coordinate_count(model.info().pose_space));
  fill(parameters);
  fill(readings);
  fill(poses);
  ClosureRows result;
  for (auto _ : state) {
    model.linearise(parameters, poses, readings, result);
    benchmark::DoNotOptimize(result.closure.data());
  }
  state.counters["pose"] = per_pose();
}

void forward(benchmark::State& state, const Mechanism& mechanism, const WorkspaceOptions& within) {
  const RowMatrix poses = sample_workspace(mechanism, within, kPoses, 1).poses;
  const RowMatrix readings = inverse_kinematics(mechanism, poses);
  const RowMatrix start = within.home.transpose();
  for (auto _ : state) {
    benchmark::DoNotOptimize(forward_kinematics(mechanism, readings, start).poses.data());
  }
  state.counters["pose"] = per_pose();
}

const bool kRegistered = [] {
  const std::vector<std::string> platforms{"rigid", "point", "translating", "spherical"};
  for (const std::string& name : platforms) {
    const Platform platform = platform_named(name);
    for (const std::string& chain : chain_names(platform)) {
      benchmark::RegisterBenchmark(("rows/" + chain + "/" + name).c_str(), rows,
                                   std::cref(leg_model(chain, platform)));
    }
  }
  benchmark::RegisterBenchmark("forward/3-RRR", forward, paper_3rrr(), paper_workspace());
  benchmark::RegisterBenchmark("forward/hexapod", forward, hexapod(), hexapod_workspace());
  return true;
}();

}  // namespace
}  // namespace symkin::testing
