// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/leg_fits.hpp"

#include <algorithm>
#include <cmath>

#include "symkin/estimation/detail/linear_fit.hpp"
#include "symkin/estimation/unknowns.hpp"
#include "symkin/model/pose_space.hpp"

namespace symkin {
namespace {

Vector leg_sizes(const Mechanism& mechanism, Index leg) {
  const Setup setup = Setup::of(mechanism);
  return natural_sizes(mechanism, setup)
      .segment(UnknownList(setup).leg(leg), mechanism.parameter_count());
}

}  // namespace

LegFits::LegFits(const Mechanism& mechanism, Index leg, const IdentificationOptions& options)
    : mechanism_(mechanism),
      leg_(leg),
      options_(options),
      model_(mechanism.model(leg)),
      estimated_(mechanism.estimated_parameters(leg)),
      pose_variances_(options.noise.pose_variances(mechanism.pose_space())),
      sizes_(leg_sizes(mechanism, leg)),
      stages_{BlockLosses{RobustLoss{}}},
      chosen_(place(lanes_)),
      states_(place(lanes_)),
      fits_(place(lanes_)),
      unit_precisions_(place(lanes_)) {
  const Index p = model_.parameter_count();
  const auto size = static_cast<Index>(estimated_.size());
  const Index closures = mechanism.closures();
  const Index most = size + closures + 4;
  room_.resize(place(4 * most * most * lanes_));
  rows_ = {0,    closures, p,       mechanism.dof(), estimated_.data(),
           size, nullptr,  nullptr, nullptr,         room_.data()};
  for (const auto& [values, count] : {std::pair{&parameters_, p},
                                      {&information_, size * size},
                                      {&inverse_, size * size},
                                      {&gradient_, size},
                                      {&step_, size},
                                      {&jackknife_, size},
                                      {&closure_squares_, Index{1}},
                                      {&judged_squares_, Index{1}},
                                      {&whitened_, Index{1}},
                                      {&decrease_, Index{1}},
                                      {&pivot_, Index{1}}}) {
    values->resize(place(count * lanes_));
  }
  for (LegFit& fit : fits_) {
    fit.variances.setZero(p);
    fit.jackknife.setZero(p);
  }
  if (options.estimator != Estimator::joint) {
    for (const RobustLoss& loss : stages_of(options.loss)) {
      stages_.emplace_back(loss);
    }
  }
}

bool LegFits::can(const IdentificationOptions& options) {
  switch (options.estimator) {
    case Estimator::joint:
      return true;
    case Estimator::implicit:
      return !options.loss.any() || options.loss.spread > 0;
    case Estimator::inverse:
      return !options.loss.any();
    case Estimator::paper:
      break;
  }
  return false;
}

void LegFits::fit(const MeasuredRobot* robots, Index count) {
  take(robots, count);
  const std::vector<bool> all(place(lanes_), true);
  if (in_readings_) {
    take_deviations();
  }
  solve(nullptr, all);
  if (stages_.size() > 1) {
    guard();
  }
  for (std::size_t stage = 1; stage < stages_.size(); ++stage) {
    const BlockLoss& loss = stages_[stage].of(rows_.closures);
    if (stages_[stage].loss().family->start == LossFamily::Start::two) {
      solve_from_two(loss);
    } else {
      solve(&loss, all);
    }
  }
  describe();
}

// Beyond a robot's last pose it stands there once more and counts nothing, as do the first robot's
// poses in the lanes beyond the last robot.
void LegFits::take(const MeasuredRobot* robots, Index count) {
  count_ = count;
  rows_.count = 1;
  for (Index lane = 0; lane < count; ++lane) {
    rows_of_leg(robots[lane], mechanism_.leg_count(), leg_, options_.use, chosen_[place(lane)]);
    rows_.count = std::max(rows_.count, static_cast<Index>(chosen_[place(lane)].size()));
  }
  const Index width = rows_.parameters + rows_.dof + 2;
  const Index coordinates = coordinate_count(mechanism_.pose_space());
  const Index closures = rows_.count * rows_.closures;
  poses_.resize(place(rows_.count * coordinates * lanes_));
  for (Packed* each : {&readings_, &present_, &squares_, &weights_, &curvatures_, &leverages_}) {
    each->resize(place(rows_.count * lanes_));
  }
  precisions_.assign(place(closures * lanes_), 0);
  closure_rows_.resize(place(closures * width * lanes_));
  rows_.rows = closure_rows_.data();
  rows_.precisions = precisions_.data();
  rows_.squares = squares_.data();
  for (Index lane = 0; lane < lanes_; ++lane) {
    const Index source = lane < count ? lane : 0;
    take(robots[source], chosen_[place(source)], lane);
    const Index closures = static_cast<Index>(chosen_[place(source)].size()) * rows_.closures;
    states_[place(lane)] = {};
    states_[place(lane)].clear = lane < count && closures >= rows_.size;
    const Vector& start = mechanism_.leg(leg_).parameters;
    for (Index k = 0; k < rows_.parameters; ++k) {
      at(parameters_, k, lane) = start[k];
    }
    fits_[place(lane)].parameters = start;
  }
}

void LegFits::take(const MeasuredRobot& robot, const std::vector<Index>& rows, Index lane) {
  const Index legs = mechanism_.leg_count();
  const Index coordinates = coordinate_count(mechanism_.pose_space());
  const auto there = static_cast<Index>(rows.size());
  double* pose = poses_.data() + lane;
  double* reading = readings_.data() + lane;
  double* present = present_.data() + lane;
  for (Index i = 0; i < rows_.count; ++i) {
    const Index row = there > 0 ? rows[place(std::min(i, there - 1))] : -1;
    for (Index k = 0; k < coordinates; ++k, pose += lanes_) {
      *pose = row < 0 ? 0 : robot.poses[row * coordinates + k];
    }
    *reading = row < 0 ? 0 : robot.readings[row * legs + leg_];
    *present = i < there ? 1 : 0;
    reading += lanes_;
    present += lanes_;
  }
}

// One stage of the fit, its loss held: Gauss-Newton's steps by the noise as it is at each state,
// and with a loss Newton's near the end.
void LegFits::solve(const BlockLoss* loss, const std::vector<bool>& which) {
  constexpr int kMostSteps = 50;
  for (Index lane = 0; lane < count_; ++lane) {
    State& state = states_[place(lane)];
    if (!which[place(lane)]) {
      continue;
    }
    state = {state.clear, state.clear};
    for (const Index k : estimated_) {
      at(parameters_, k, lane) = fits_[place(lane)].parameters[k];
    }
  }
  const int most = std::min(options_.max_iterations, kMostSteps);
  const auto runs = [](const State& state) { return state.runs; };
  for (int tried = 0; std::any_of(states_.begin(), states_.end(), runs); ++tried) {
    in_readings_ ? linearise_readings() : linearise();
    if (loss != nullptr) {
      weigh(*loss);
    }
    kernels_.sum(rows_, loss == nullptr ? nullptr : weights_.data(),
                 loss == nullptr ? nullptr : curvatures_.data(), information_.data(),
                 gradient_.data());
    kernels_.solve(rows_, information_.data(), gradient_.data(), step_.data(), decrease_.data(),
                   pivot_.data());
    for (Index lane = 0; lane < count_; ++lane) {
      if (states_[place(lane)].runs) {
        step(lane, loss, tried < most);
      }
    }
  }
}

// Closures, whitened by the noise.
void LegFits::linearise() {
  model_.linearise_lanes({lanes_, rows_.count, parameters_.data(), poses_.data(), readings_.data()},
                         rows_.rows);
  kernels_.whiten(rows_, pose_variances_.data(), options_.noise.reading * options_.noise.reading,
                  present_.data(),
                  {closure_squares_.data(), judged_squares_.data(), whitened_.data()});
}

void LegFits::weigh(const BlockLoss& loss) {
  std::fill(whitened_.begin(), whitened_.end(), 0);
  for (Index i = 0; i < rows_.count; ++i) {
    for (Index lane = 0; lane < lanes_; ++lane) {
      const BlockLoss::Value value = loss.at(at(squares_, i, lane));
      at(weights_, i, lane) = value.weight;
      at(curvatures_, i, lane) = states_[place(lane)].newton ? 2 * value.by_square : 0;
      at(whitened_, 0, lane) += value.cost;
    }
  }
}

// One lane's. The last step, short beside the root of the cost and much shorter than the one
// before, is taken by the estimate alone: the rows stay as they are, whatever the other lanes do.
// Of the start of `joint` it is one that is short beside the leg or beside the cost: what that
// leaves is less than the noise, by which `joint` moves on in any case.
void LegFits::step(Index lane, const BlockLoss* loss, bool may_move) {
  // What a last step may leave, if steps go on to shorten as it did, or how long it may be.
  constexpr double kLeft = 1e-10;
  constexpr double kJointLeft = 1e-4;
  constexpr double kJointStart = 1e-2;  // of a natural size
  constexpr double kRobustEnds = 1e-7;  // squares that are not weighted change with the step
  constexpr double kNear = 1e-2;
  constexpr double kSlack = 1e-10;  // of the cost
  constexpr double kRounding = 1e-9;
  constexpr double kNewton = 0.3;  // of a deviation, the longest of Newton's steps
  constexpr double kPoor = 1e-9;   // a pivot of Newton's: the loss has no minimum
  const bool joint = options_.estimator == Estimator::joint;
  State& state = states_[place(lane)];
  const double decrease = at(decrease_, 0, lane), pivot = at(pivot_, 0, lane);
  const double cost = at(whitened_, 0, lane);
  const double distance = std::sqrt(decrease / (cost + 1));
  if (state.newton && !(pivot > kPoor && distance < state.distance)) {
    state.newton = false;  // the same state once more
    state.distance = std::numeric_limits<double>::infinity();
    return;
  }
  const bool descends = loss != nullptr || state.distance < kNear ||
                        at(judged_squares_, 0, lane) <= state.cost + kSlack * (state.cost + 1);
  if (!std::isfinite(distance) || !descends || !(state.newton || LinearFit::is_clear(pivot))) {
    state.runs = state.clear = false;
    return;
  }
  Vector& parameters = fits_[place(lane)].parameters;
  double size = 0;  // of the step
  for (Index k = 0; k < rows_.size; ++k) {
    const Index parameter = estimated_[place(k)];
    parameters[parameter] = at(parameters_, parameter, lane) + at(step_, k, lane);
    size = std::max(size, std::abs(at(step_, k, lane)) / sizes_[parameter]);
  }
  const double leaves = distance * distance / std::min(state.distance, 1.0);
  const bool is_last = loss == nullptr
                           ? leaves < (joint ? kJointLeft : kLeft) || distance < kRounding
                           : distance < kRobustEnds;
  if (is_last || (joint && size < kJointStart)) {
    state.runs = false;
    state.cost = cost;
    return;
  }
  if (!may_move) {
    state.runs = state.clear = false;
    return;
  }
  for (const Index parameter : estimated_) {
    at(parameters_, parameter, lane) = parameters[parameter];
  }
  state.cost = cost;
  state.distance = distance;
  state.newton = loss != nullptr && std::sqrt(decrease) < kNewton;
}

// As detail::fit_from_two() does, from Huber's fit.
void LegFits::solve_from_two(const BlockLoss& loss) {
  constexpr double kLower = 1e-9;  // of the cost: equal minima are one
  const std::vector<LegFit> huber = fits_;
  std::vector<bool> rejecting(place(lanes_)), other_is_lower(place(lanes_));
  for (Index lane = 0; lane < count_; ++lane) {
    if (states_[place(lane)].clear && rejects(lane)) {
      rejecting[place(lane)] = true;
      fits_[place(lane)].parameters(estimated_) += best_of_subsets(system(lane)).change;
    }
  }
  solve(&loss, rejecting);
  const std::vector<LegFit> others = fits_;
  const std::vector<State> ends = states_;
  for (std::size_t lane = 0; lane < rejecting.size(); ++lane) {
    fits_[lane].parameters = huber[lane].parameters;
    states_[lane].clear = states_[lane].clear || rejecting[lane];
  }
  solve(&loss, std::vector<bool>(place(lanes_), true));
  for (std::size_t lane = 0; lane < rejecting.size(); ++lane) {
    State& state = states_[lane];
    if (rejecting[lane] && ends[lane].clear &&
        (!state.clear || ends[lane].cost < state.cost * (1 - kLower))) {
      fits_[lane].parameters = others[lane].parameters;
      state.clear = other_is_lower[lane] = true;
    }
  }
  solve(&loss, other_is_lower);
}

RowMatrix parameters_of(const std::vector<LegFits>& legs, Index robot) {
  RowMatrix parameters;
  for (std::size_t leg = 0; leg < legs.size(); ++leg) {
    const LegFit& fit = legs[leg].of(robot);
    if (!fit.clear) {
      return {};
    }
    parameters.resize(static_cast<Index>(legs.size()), fit.parameters.size());
    parameters.row(static_cast<Index>(leg)) = fit.parameters.transpose();
  }
  return parameters;
}

RowMatrix joint_start(const Mechanism& mechanism, const MeasurementSet& measurements,
                      const IdentificationOptions& options) {
  const MeasuredRobot robot = MeasuredRobot::of(mechanism, measurements);
  std::vector<LegFits> legs;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    legs.emplace_back(mechanism, leg, options).fit(&robot, 1);
  }
  return parameters_of(legs, 0);
}

}  // namespace symkin
