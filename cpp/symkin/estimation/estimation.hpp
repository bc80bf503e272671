// SPDX-License-Identifier: MIT
#pragma once

// From measurements to parameters: noise, the rows of the identification matrix
// (observability.hpp), estimators, covariances, diagnosis, simulation and evaluation.
#include "symkin/estimation/accuracy.hpp"
#include "symkin/estimation/diagnosis.hpp"
#include "symkin/estimation/evaluation.hpp"
#include "symkin/estimation/fleet.hpp"
#include "symkin/estimation/goodness_of_fit.hpp"
#include "symkin/estimation/identification.hpp"
#include "symkin/estimation/joint.hpp"
#include "symkin/estimation/leg_rows.hpp"
#include "symkin/estimation/measurements.hpp"
#include "symkin/estimation/noise.hpp"
#include "symkin/estimation/observability.hpp"
#include "symkin/estimation/observations.hpp"
#include "symkin/estimation/robust_loss.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/estimation/starting_point.hpp"
#include "symkin/estimation/unknowns.hpp"
