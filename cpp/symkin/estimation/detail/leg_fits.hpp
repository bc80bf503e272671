// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "symkin/estimation/detail/lane_kernels.hpp"
#include "symkin/estimation/detail/robust_fit.hpp"
#include "symkin/estimation/fleet.hpp"

namespace symkin {

// What the measurements say of a leg of one robot.
struct LegFit {
  bool clear = false;  // what follows holds; otherwise the fit wants a closer look
  Vector parameters;   // p
  Vector variances;    // p, by the declared noise and the weights of the loss
  Vector jackknife;    // p, by the residuals, see residual_covariance()
  GoodnessOfFit goodness;
  double closure_squares = 0;  // sum, m^2
  Index closures = 0;
  Index rejected = 0;
  double student_degrees = std::numeric_limits<double>::infinity();

  // Whether its declared noise says too little of its variances.
  bool wants_jackknife() const { return goodness.unexplained() && std::isinf(student_degrees); }
};

// The estimators `implicit` and `inverse`, or the start of `joint`, for one leg of as many robots
// as the processor has lanes. A robot whose steps do not lead straight to rest, whose rows are
// close to dependent or that follows a pose by itself where a loss was asked for is not clear: it
// is for identify(), which says what is wrong with it. A robot's numbers depend on nothing but its
// own.
class LegFits {
 public:
  // These outlive it.
  LegFits(const Mechanism& mechanism, Index leg, const IdentificationOptions& options);
  LegFits(LegFits&&) noexcept = default;  // a copy's rows would be addresses of the other's

  static Index lanes() { return lane_kernels().lanes; }
  static bool can(const IdentificationOptions& options);

  // Of up to so many robots.
  void fit(const MeasuredRobot* robots, Index count);
  // Of those fitted last.
  const LegFit& of(Index robot) const { return fits_[static_cast<std::size_t>(robot)]; }
  // Fills in `jackknife`, which is seldom asked for.
  void find_jackknife();

 private:
  using Packed = std::vector<double>;  // numbers of all lanes side by side
  // Where a lane's fit stands.
  struct State {
    bool runs = false;
    bool clear = false;
    bool newton = false;  // with the second derivatives of the loss
    double cost = std::numeric_limits<double>::infinity();
    double distance = std::numeric_limits<double>::infinity();  // of the last step
  };
  double& at(Packed& values, Index i, Index lane) const { return values[place(i * lanes_ + lane)]; }
  static std::size_t place(Index i) { return static_cast<std::size_t>(i); }

  void take(const MeasuredRobot* robots, Index count);
  void take(const MeasuredRobot& robot, const std::vector<Index>& rows, Index lane);
  void solve(const BlockLoss* loss, const std::vector<bool>& which);
  void solve_from_two(const BlockLoss& loss);
  void linearise();
  void linearise_readings();
  void take_deviations();
  Packed weigh_as_readings();
  void weigh(const BlockLoss& loss);
  void step(Index lane, const BlockLoss* loss, bool may_move);
  void guard();
  bool rejects(Index lane);
  WhitenedSystem system(Index lane);
  void describe();
  double variance(Packed& noise, Index k, Index lane);
  double describe_robust(Index lane, LegFit& fit);
  const GoodnessOfFit& judge(double chi_square, Index degrees_of_freedom);

  const Mechanism& mechanism_;
  Index leg_;
  const IdentificationOptions& options_;
  const LegModel& model_;
  const LaneKernels& kernels_ = lane_kernels();
  Index lanes_ = kernels_.lanes;
  const std::vector<Index>& estimated_;
  Vector pose_variances_;
  Vector sizes_;                     // natural ones of the parameters
  std::vector<BlockLosses> stages_;  // least squares, and those of the loss

  Index count_ = 0;  // of robots
  std::vector<std::vector<Index>> chosen_;
  std::vector<State> states_;
  std::vector<LegFit> fits_;
  bool in_readings_ = options_.estimator == Estimator::inverse;
  std::vector<double> unit_precisions_;  // of g - psi, a lane each
  ClosureLanes rows_;
  Packed parameters_, poses_, readings_, present_, closure_rows_, precisions_, squares_, room_;
  Packed weights_, curvatures_, leverages_;
  Packed closure_squares_, judged_squares_, whitened_;
  Packed information_, gradient_, step_, decrease_, pivot_, inverse_, jackknife_;
  std::map<Index, GoodnessOfFit> judged_;  // by degrees of freedom
};

// Of all legs of a robot, legs x p; empty where a leg is not clear.
RowMatrix parameters_of(const std::vector<LegFits>& legs, Index robot);
// From where `joint` starts, as far as the legs by themselves are clear.
RowMatrix joint_start(const Mechanism& mechanism, const MeasurementSet& measurements,
                      const IdentificationOptions& options);

}  // namespace symkin
