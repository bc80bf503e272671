// SPDX-License-Identifier: MIT

// Pose selection for one leg of the paper's mechanism, 24 poses of n candidates, on one thread
// unless a second argument says otherwise. Counters: log_det, the efficiency against sets without
// repeats, branch and bound nodes, seeds that found the best value, and the peak memory of the
// process so far, with the candidates' poses and rows.

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>

#include "support/mechanisms.hpp"
#include "support/paper_leg.hpp"
#include "symkin/design/design.hpp"
#include "symkin/estimation/leg_rows.hpp"

namespace symkin::testing {
namespace {

using design::CandidateRows;
using design::select_poses;
using design::Selection;
using design::SelectionMethod;
using design::SelectionOptions;

SelectionOptions paper_options(SelectionMethod method) {
  SelectionOptions options;
  options.count = 24;
  options.method = method;
  options.threads = 1;
  return options;
}

// Sampling takes longer than anything that is timed here: many poses lie about fewer sampled ones,
// nearer to them than these are to the end of a leg's reach.
RowMatrix dense_poses(Index count) {
  constexpr Index kSampled = 100'000;
  constexpr double kAbout = 0.01;
  if (count <= kSampled) {
    return paper_poses(count);
  }
  Random random(2);
  RowMatrix poses = paper_poses(kSampled).replicate(count / kSampled, 1);
  for (Index i = kSampled * 3; i < poses.size(); ++i) {
    poses.data()[i] += kAbout * (2 * random.uniform() - 1);
  }
  return poses;
}

const RowMatrix& cached_poses(Index count) {
  static RowMatrix poses;
  if (poses.rows() != count) {
    poses = dense_poses(count);
  }
  return poses;
}

double peak_mebibytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

void report(benchmark::State& state, const Selection& selection) {
  state.counters["log_det"] = selection.log_det;
  state.counters["efficiency"] = selection.certificate.efficiency_distinct;
  state.counters["peak_MiB"] = peak_mebibytes();
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

// The project's own kinematics: rows in memory, and rows made when they are needed.
const Mechanism& mechanism() {
  static const Mechanism made = paper_3rrr();
  return made;
}

const RowMatrix& mechanism_poses(Index count) {
  static RowMatrix poses;
  if (poses.rows() != count) {
    poses = sample_workspace(mechanism(), paper_workspace(), count, 1).poses;
  }
  return poses;
}

void BM_LegRowsInMemory(benchmark::State& state) {
  const RowMatrix& poses = mechanism_poses(state.range(0));
  SelectionOptions options = paper_options(SelectionMethod::exchange);
  options.threads = static_cast<int>(state.range(1));
  Selection selection;
  for (auto _ : state) {
    const RowMatrix rows = observability_rows(mechanism(), 0, poses, RowKind::paper);
    selection = select_poses(CandidateRows{rows}, options);
  }
  report(state, selection);
}

// The third argument: whether the rows that are made are kept.
void BM_LegRowsMade(benchmark::State& state) {
  const LegRows rows(mechanism(), 0, mechanism_poses(state.range(0)), RowKind::paper);
  SelectionOptions options = paper_options(SelectionMethod::exchange);
  options.threads = static_cast<int>(state.range(1));
  options.memory_limit_bytes = state.range(2) != 0 ? options.memory_limit_bytes : 0;
  Selection selection;
  for (auto _ : state) {
    selection = select_poses(rows, options);
  }
  report(state, selection);
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
BENCHMARK(BM_TwentySeeds)->Arg(3'000)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Proof)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_ActiveCalibration)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_WholeMechanism)->Arg(30'000)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_LegRowsInMemory)
    ->ArgsProduct({{30'000, 300'000}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(BM_LegRowsMade)
    ->ArgsProduct({{30'000, 300'000}, {1, 2}, {1, 0}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(BM_Exchange)
    ->ArgsProduct({{10'000, 100'000, 1'000'000, 10'000'000}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace symkin::testing
