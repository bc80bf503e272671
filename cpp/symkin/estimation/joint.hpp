// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "symkin/estimation/goodness_of_fit.hpp"
#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/robust_loss.hpp"
#include "symkin/estimation/unknowns.hpp"

namespace symkin {

// How directions that no observation shows and no prior holds are chosen, such as a motion of the
// frames that the end points follow. None of the fit, the residuals and the poses as measured
// depends on it; parameters and their deviations do.
enum class Gauge {
  nominal,  // of all solutions the one nearest to the start, in tolerances
  refuse,   // NotIdentifiable
};

struct JointOptions {
  RobustLoss loss;  // of whole poses
  int max_iterations = 100;
  Gauge gauge = Gauge::refuse;
  // A typical size of each column's change, its tolerance: what directions are compared in. Zero
  // for one that has none (frames): the gauge does not count it.
  Vector tolerances;
  // Where the latent poses start, N x coordinates; NaN where nothing is known.
  RowMatrix start;
  // Whether to say something of every row, which takes up to the time of the fit; without, the
  // latent poses may be a step behind where there is no loss.
  bool rows = true;
};

// One row of the observations and what the fit says of it.
struct RowFit {
  Index pose;
  // RowOrigin::Kind: 0 a reading, 1 pose, 2 reported pose, 3 point, 4 distance, 5 height, 6
  // attitude, 7 turn; between poses, and then of that which names the other, 8 separation, 9 rise,
  // 10 offset.
  int kind;
  Index index;  // the leg, the component, the point's coordinate, the anchor, the angle, the pair
  double residual;  // estimated error of the observation: what it is too large by, in its own unit
  double t;         // standard normal if the row is sound, NaN where nothing can be said
  double blunder;   // the error that it would have if it alone were wrong, in its own unit
};

struct JointFit {
  Setup setup;    // the estimate
  Vector change;  // of the columns since the start
  // Of the columns; scaled by goodness.spread() but for the priors' share, or with a loss by what
  // its weights and residuals ask for.
  RowMatrix covariance;
  RowMatrix model_covariance;  // of noise and priors as declared, whatever the residuals are
  // Of Student's t, which errors over their deviations follow; infinite without a loss.
  double student_degrees = std::numeric_limits<double>::infinity();
  std::vector<Index> unguarded;  // poses at which the loss would not see a gross error
  RowMatrix poses;               // N x coordinates, the latent ones; NaN where set aside
  RowMatrix reading_errors;      // N x legs, psi_true - psi_read
  std::vector<RowFit> rows;
  std::vector<Index> conditions;  // of each pose, r_j; of a block of poses at its first
  Vector chi_squares;             // of each pose, likewise
  Vector loss_weights;            // of each pose, 1 without a loss
  std::vector<Index> aside;       // poses that no start was found for, or nothing observed at
  double chi_square_data = 0;     // sum over the poses
  double chi_square_prior = 0;
  GoodnessOfFit goodness;  // of both together, without poses that the loss rejects
  Index rank = 0;          // of data and priors
  Index data_rank = 0;
  // Directions of the columns, each of length one in tolerances, that the data alone do not show.
  RowMatrix unseen;            // columns x (columns - data_rank)
  Index gauge_directions = 0;  // of these, that no prior holds
  bool converged = false;
  std::string failure;
  int iterations = 0;
};

// Maximum likelihood of everything that the layout frees, from whatever was observed: the true
// poses are unknown, and each is eliminated for itself (theory: one estimator for all
// measurements). Throws InvalidInput for observations that do not fit the mechanism, and
// NotIdentifiable, with directions of the columns, where Gauge::refuse meets one that nothing
// shows.
JointFit fit_jointly(const Mechanism& mechanism, const Setup& start,
                     const Observations& observations, const Layout& layout,
                     const JointOptions& options = {});

// What the observations of one pose that a fit set aside leave unexplained, as a sum of squares
// over their variances, where they leave least: at the estimate `setup`, from the latent poses (N x
// coordinates, NaN where set aside) with near readings. Infinite where none leads to a pose of
// their working modes and aspect. A fit leaves out poses that the noise explains where their
// observations hardly show a direction, in which they cannot be linearised. Throws InvalidInput for
// arrays that do not fit each other.
double left_unexplained(const Mechanism& mechanism, const Setup& setup,
                        const Observations& observations, const RowMatrix& poses, Index pose);

}  // namespace symkin
