// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "symkin/estimation/goodness_of_fit.hpp"
#include "symkin/estimation/measurements.hpp"
#include "symkin/estimation/noise.hpp"
#include "symkin/estimation/robust_loss.hpp"
#include "symkin/model/mechanism.hpp"

namespace symkin {

enum class Estimator {
  paper,     // per leg: Gauss-Newton on g - psi (Eqs. 15, 24-26); of legs with one closure
  inverse,   // per leg: the same cost by Levenberg-Marquardt, with a robust loss if asked for
  implicit,  // per leg: whitened closures h / sqrt(v), robust loss; finite where g has no root
  joint,     // all legs at once, with the true poses unknown: maximum likelihood, see fit_jointly()
};

struct IdentificationOptions {
  Estimator estimator = Estimator::implicit;
  PoseUse use = PoseUse::all;
  MeasurementNoise noise;
  RobustLoss loss;
  int max_iterations = 100;
  // LegIdentification::condition, and of `joint` also `standardised`: a fleet can do without.
  bool conditions = true;

  void check() const;  // throws InvalidInput
};

// What the measurements say of one leg.
struct LegIdentification {
  std::vector<Index> rows;      // of the measurements that the leg used
  Vector residuals;             // closures h at the estimate, metres, one a row (k a row where
                                // the chain has k closures)
  Vector standardised;          // h / sqrt(v): standard normal if noise and model are right; of
                                // several closures a row each less what those before it say of it
  std::vector<Index> rejected;  // rows whose robust weight fell below one half
  bool converged = false;
  std::string failure;   // why not
  int iterations = 0;    // accepted steps of the solver
  double condition = 0;  // of the Jacobian with columns of length one; NaN if not asked for
  // Of Student's t, which errors over their deviations follow; infinite without a loss, where the
  // deviations are those of the declared noise.
  double student_degrees = std::numeric_limits<double>::infinity();
  std::vector<Index> unguarded;  // rows at which the loss would not see a gross error
};

struct Identification {
  RowMatrix parameters;  // legs x p
  // Of all parameters, leg by leg, (legs p) x (legs p); legs are correlated where they share poses.
  // Where a fit is larger than the declared noise explains (GoodnessOfFit::unexplained), that of
  // `joint` is scaled up by chi-square per degree of freedom, and that of the other estimators is
  // taken from the residuals of all legs. With a loss it follows its weights and the residuals that
  // they keep.
  RowMatrix covariance;
  std::vector<LegIdentification> legs;
  std::vector<GoodnessOfFit> goodness;  // one a leg; of `joint`, one of all legs
  bool converged = false;               // every leg did
  double residual_rms = 0;              // closures of all legs, metres
  double residual_max = 0;
};

// Identifies every leg from the measurements, starting from the mechanism's parameters. Throws
// InvalidInput for fewer poses than parameters, NaN poses, readings that fit no leg, or a loss that
// a gross error at some pose would escape, and NotIdentifiable, with the leg's combinations of
// parameters, if its poses and readings leave some without effect on any closure.
Identification identify(const Mechanism& mechanism, const MeasurementSet& measurements,
                        const IdentificationOptions& options = {});

}  // namespace symkin
