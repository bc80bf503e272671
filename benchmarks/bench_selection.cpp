// SPDX-License-Identifier: MIT

// Pose selection for one leg of the paper's mechanism, 24 poses of n candidates, on one thread
// unless said. Counters: log_det, the efficiency against sets without repeats, branch and bound
// nodes, seeds that found the best value.

#include <benchmark/benchmark.h>

#include <algorithm>

#include "support/paper_leg.hpp"
#include "symkin/selection/selection.hpp"

namespace symkin::testing {
namespace {

SelectionOptions paper_options(SelectionMethod method) {
  SelectionOptions options;
  options.count = 24;
  options.method = method;
  options.threads = 1;
  return options;
}

// Sampling the workspace takes longer than anything that is timed here.
const RowMatrix& cached_poses(Index count) {
  static RowMatrix poses;
  if (poses.rows() != count) {
    poses = paper_poses(count);
  }
  return poses;
}

void report(benchmark::State& state, const Selection& selection) {
  state.counters["log_det"] = selection.log_det;
  state.counters["efficiency"] = selection.certificate.efficiency_distinct;
}

void BM_Rows(benchmark::State& state) {
  const RowMatrix& poses = cached_poses(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(paper_rows(poses));
  }
}

void BM_RowsSelectionAndCertificate(benchmark::State& state) {
  const RowMatrix& poses = cached_poses(state.range(0));
  Selection selection;
  for (auto _ : state) {
    const RowMatrix rows = paper_rows(poses);
    selection = select_poses(CandidateRows{rows}, paper_options(SelectionMethod::exchange));
  }
  report(state, selection);
}

void BM_Exchange(benchmark::State& state) {
  const RowMatrix rows = paper_rows(cached_poses(state.range(0)));
  SelectionOptions options = paper_options(SelectionMethod::exchange);
  options.threads = static_cast<int>(state.range(1));
  Selection selection;
  for (auto _ : state) {
    selection = select_poses(CandidateRows{rows}, options);
  }
  report(state, selection);
}

// How many of 20 seeds find the best value of all.
void BM_TwentySeeds(benchmark::State& state) {
  const RowMatrix rows = paper_rows(cached_poses(state.range(0)));
  SelectionOptions options = paper_options(SelectionMethod::exchange);
  std::vector<double> found;
  for (auto _ : state) {
    found.clear();
    for (options.seed = 1; options.seed <= 20; ++options.seed) {
      found.push_back(select_poses(CandidateRows{rows}, options).log_det);
    }
  }
  const double best = *std::max_element(found.begin(), found.end());
  state.counters["best"] = static_cast<double>(
      std::count_if(found.begin(), found.end(), [&](double v) { return v > best - 1e-9; }));
}

void BM_Proof(benchmark::State& state) {
  const RowMatrix rows = paper_rows(cached_poses(state.range(0)));
  Selection selection;
  for (auto _ : state) {
    selection = select_poses(CandidateRows{rows}, paper_options(SelectionMethod::exhaustive));
  }
  report(state, selection);
  state.counters["nodes"] = static_cast<double>(selection.nodes);
  state.counters["proven"] = selection.certificate.proven_optimal ? 1 : 0;
}

void BM_ActiveCalibration(benchmark::State& state) {
  const RowMatrix rows = paper_rows(cached_poses(state.range(0)));
  Selection selection;
  for (auto _ : state) {
    selection = select_poses(CandidateRows{rows}, paper_options(SelectionMethod::sun_hollerbach));
  }
  report(state, selection);
}

// Three legs at each pose, all 24 parameters at once.
void BM_WholeMechanism(benchmark::State& state) {
  const RowMatrix& poses = cached_poses(state.range(0));
  RowMatrix rows = RowMatrix::Zero(3 * poses.rows(), 24);
  for (int leg = 0; leg < 3; ++leg) {
    const RowMatrix of_leg = paper_rows(poses, leg);
    for (Index j = 0; j < poses.rows(); ++j) {
      rows.row(3 * j + leg).segment(8 * leg, 8) = of_leg.row(j);
    }
  }
  Selection selection;
  for (auto _ : state) {
    selection = select_poses(CandidateRows{rows, 3}, paper_options(SelectionMethod::exchange));
  }
  report(state, selection);
}

BENCHMARK(BM_Rows)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_RowsSelectionAndCertificate)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_TwentySeeds)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Proof)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_ActiveCalibration)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_WholeMechanism)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Exchange)
    ->ArgsProduct({{30'000}, {1}})
    ->ArgsProduct({{1'000'000}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace symkin::testing
