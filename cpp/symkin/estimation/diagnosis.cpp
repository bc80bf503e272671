// SPDX-License-Identifier: MIT
#include "symkin/estimation/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "symkin/estimation/detail/covariance.hpp"
#include "symkin/estimation/detail/projection.hpp"
#include "symkin/estimation/detail/statistics.hpp"
#include "symkin/estimation/detail/whitened_closures.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// Residuals this far below the declared noise, in variance, are those of arithmetic.
constexpr double kRounding = 1e-10;
constexpr double kUntested = std::numeric_limits<double>::quiet_NaN();

using Columns = std::vector<Vector>;  // of a leg's closures at all measured poses, metres

class Diagnostician {
 public:
  Diagnostician(const Mechanism& mechanism, const MeasurementSet& measurements,
                const WhitenedClosures& system, const std::vector<bool>& left_out, double alarm,
                Diagnosis& diagnosis)
      : mechanism_(mechanism),
        closures_(mechanism.closures()),
        measurements_(measurements),
        system_(system),
        diagnosis_(diagnosis),
        projection_(judge_poses(left_out, alarm)) {
    diagnosis_.chi_square += projection_.chi_square();
    diagnosis_.degrees_of_freedom += projection_.degrees_of_freedom();
  }

  // Whether there is anything to test: exact data leave rounding errors.
  bool testable() const {
    return projection_.degrees_of_freedom() > 1 &&
           projection_.chi_square() >
               kRounding * static_cast<double>(projection_.degrees_of_freedom());
  }

  void test_sensors(bool turning) {
    test_each_and_all(Suspect::sensor_curvature, system_.legs, [this](Index leg) {
      const Vector readings = measurements_.readings.col(leg);
      return Columns{through_sensor(leg, (readings.array() - middle(readings)).square())};
    });
    if (turning) {
      test_each_and_all(Suspect::sensor_eccentricity, turning_legs(), [this](Index leg) {
        const Vector readings = measurements_.readings.col(leg);
        return Columns{through_sensor(leg, readings.array().cos()),
                       through_sensor(leg, readings.array().sin())};
      });
    }
  }

  void test_geometry() {
    const PoseSpace space = mechanism_.pose_space();
    const Index dof = mechanism_.dof();
    const Index count = measurements_.poses.rows();
    RowMatrix coordinates(count, dof);
    for (Index i = 0; i < count; ++i) {
      Vector difference(dof);
      pose_difference(space, measurements_.poses.row(i).data(),
                      measurements_.poses.row(count / 2).data(), difference.data());
      coordinates.row(i) = difference.transpose();
    }
    const Eigen::RowVectorXd mean = coordinates.colwise().mean();
    coordinates.rowwise() -= mean;
    Columns terms;
    for (Index closure = 0; closure < closures_; ++closure) {
      for (Index c = 0; c < dof; ++c) {
        terms.push_back(in_closure(closure, coordinates.col(c)));
      }
      for (Index c = 0; c < dof; ++c) {
        terms.push_back(in_closure(closure, coordinates.col(c).cwiseAbs2()));
      }
    }
    for (const Index leg : system_.legs) {
      ResidualTest test = term_test(Suspect::geometry, leg, {{leg, terms}});
      double largest = -1;
      for (std::size_t term = 0; term < terms.size(); ++term) {
        const double alone = term_test(Suspect::geometry, leg, {{leg, {terms[term]}}}).statistic;
        if (alone > largest) {
          largest = alone;
          test.other = static_cast<Index>(term) % (2 * dof);
        }
      }
      diagnosis_.tests.push_back(test);
    }
  }

  void test_order() {
    std::vector<std::pair<Index, Index>> pairs;
    std::vector<Index> last(static_cast<std::size_t>(mechanism_.leg_count() * closures_), -1);
    for (std::size_t k = 0; k < system_.poses.size(); ++k) {
      const WhitenedPose& pose = system_.poses[k];
      for (Index i = 0; projection_.counts(k) && i < pose.count(); ++i) {
        const Index leg = pose.legs[static_cast<std::size_t>(i / closures_)];
        Index& before = last[static_cast<std::size_t>(leg * closures_ + i % closures_)];
        if (before >= 0) {
          pairs.emplace_back(before, pose.first + i);
        }
        before = pose.first + i;
      }
    }
    add_pairs(Suspect::order, -1, -1, pairs);
  }

  void test_legs() {
    for (const Index a : system_.legs) {
      for (const Index b : system_.legs) {
        if (a >= b) {
          continue;
        }
        std::vector<std::pair<Index, Index>> pairs;
        for (std::size_t k = 0; k < system_.poses.size(); ++k) {
          const Index first = row_of(k, a);
          const Index second = row_of(k, b);
          for (Index c = 0; projection_.counts(k) && first >= 0 && second >= 0 && c < closures_;
               ++c) {
            pairs.emplace_back(first + c, second + c);
          }
        }
        add_pairs(Suspect::legs, a, b, pairs);
      }
    }
  }

  // The estimate of `implicit` less that of `joint` is linear in the residuals: an F test of the
  // directions that it depends on. The quadratic form in the inverse covariance of the difference
  // (Hausman's) would reject too many sound robots.
  void test_estimators() {
    constexpr double kDirections = 0.01;  // of the largest, in variance
    const RowMatrix jacobian = projection_.kept(system_.jacobian);
    const RowMatrix covariance = inverse_information(jacobian);
    if (!covariance.allFinite()) {
      return;
    }
    RowMatrix contrast = -product(covariance, jacobian.transpose());  // parameters x rows
    for (const Index leg : system_.legs) {
      const Index position = system_.position(leg);
      const ClosureRows& rows = system_.rows[static_cast<std::size_t>(position)];
      std::vector<std::pair<std::size_t, Index>> used;  // pose of the system, leg within it
      for (std::size_t k = 0; k < system_.poses.size(); ++k) {
        const Index row = row_of(k, leg);
        if (projection_.counts(k) && row >= 0) {
          used.emplace_back(k, row - system_.poses[k].first);
        }
      }
      const std::vector<Index>& estimated = mechanism_.estimated_parameters(leg);
      const auto p = static_cast<Index>(estimated.size());
      RowMatrix by_parameters(static_cast<Index>(used.size()), p);
      Vector factors(static_cast<Index>(used.size()));
      for (std::size_t i = 0; i < used.size(); ++i) {
        const WhitenedPose& pose = system_.poses[used[i].first];
        by_parameters.row(static_cast<Index>(i)) = rows.by_parameters.row(pose.row)(estimated);
        factors[static_cast<Index>(i)] = 1 / pose.factor.row(used[i].second).norm();
      }
      const RowMatrix influence = least_squares_influence(by_parameters, factors);
      for (std::size_t i = 0; i < used.size(); ++i) {
        const WhitenedPose& pose = system_.poses[used[i].first];
        contrast.block(system_.columns[static_cast<std::size_t>(position)], pose.first, p,
                       pose.count()) +=
            influence.col(static_cast<Index>(i)) * pose.factor.row(used[i].second);
      }
    }
    contrast = covariance.diagonal().cwiseSqrt().cwiseInverse().asDiagonal() * contrast;
    const SymmetricEigen eigen = symmetric_eigen(product(contrast, contrast.transpose()));
    const Vector& squares = eigen.values;  // ascending
    const double largest = squares[squares.size() - 1];
    if (!(largest > 1e-12)) {  // of a standard deviation: the estimators are the same
      return;
    }
    const Index terms = (squares.array() > kDirections * largest).count();
    const RowMatrix directions = product(eigen.vectors.rightCols(terms).transpose(), contrast);
    const Vector values =
        (directions * projection_.residual()).cwiseQuotient(squares.tail(terms).cwiseSqrt());
    ResidualTest test{Suspect::estimators};
    set_f(test, values.squaredNorm(), terms);
    diagnosis_.tests.push_back(test);
  }

 private:
  // Row of a leg's first closure at a pose of the system; -1 if it was not read there.
  Index row_of(std::size_t pose, Index leg) const {
    const WhitenedPose& which = system_.poses[pose];
    const auto found = std::find(which.legs.begin(), which.legs.end(), leg);
    return found == which.legs.end() ? -1 : which.first + closures_ * (found - which.legs.begin());
  }

  double middle(const Vector& readings) const {
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (Index i = 0; i < readings.size(); ++i) {
      if (std::isfinite(readings[i])) {
        least = std::min(least, readings[i]);
        most = std::max(most, readings[i]);
      }
    }
    return (least + most) / 2;
  }

  // A term of the reading, one a pose, as it shows in the leg's closures.
  Vector through_sensor(Index leg, const Vector& term) const {
    Vector shown = system_.rows[static_cast<std::size_t>(system_.position(leg))].by_reading;
    for (Index i = 0; i < shown.size(); ++i) {
      shown[i] *= term[i / closures_];
    }
    return shown;
  }

  // A term, one a pose, in one of a leg's closures.
  Vector in_closure(Index closure, const Vector& term) const {
    Vector shown = Vector::Zero(term.size() * closures_);
    shown(Eigen::seqN(closure, term.size(), closures_)) = term;
    return shown;
  }

  // Every pose against the others; those that stand out are left out of what comes after.
  Projection judge_poses(const std::vector<bool>& left_out, double alarm) {
    const Projection projection(system_, left_out);
    const Index dof = projection.degrees_of_freedom();
    const double chi_square = projection.chi_square();
    const bool exact = chi_square <= kRounding * static_cast<double>(dof);
    std::vector<bool> outliers = left_out;
    for (std::size_t k = 0; k < system_.poses.size() && !exact && dof > 0; ++k) {
      const WhitenedPose& pose = system_.poses[k];
      const auto [error, covariance] = projection.predicted(k);
      const auto [inverse, n] = symmetric_inverse(covariance);
      const Vector solved = inverse * error;
      // A pose that counts is taken out of the chi-square that it is compared with.
      const bool counts = projection.counts(k);
      const double square = error.dot(solved);
      const double others = chi_square - (counts ? square : 0);
      const Index spare = dof - (counts ? n : 0);
      const double p =
          f_tail(square / static_cast<double>(n) / others * static_cast<double>(spare), n, spare);
      diagnosis_.pose_p[pose.row] = std::min(diagnosis_.pose_p[pose.row], p);
      const RowMatrix units = lower_inverse(pose.factor);
      const RowMatrix directions = product(inverse, units);
      for (Index i = 0; i < pose.count(); ++i) {
        const Index leg = pose.legs[static_cast<std::size_t>(i / closures_)];
        const double value =
            units.col(i).dot(solved) / std::sqrt(units.col(i).dot(directions.col(i)));
        const double rest = chi_square - (counts ? value * value : 0);
        const Index freedom = dof - (counts ? 1 : 0);
        const double student =
            value / std::sqrt(std::max(rest, 0.0) / static_cast<double>(freedom));
        // Of several closures of a leg the one that stands out most.
        const double p_value = static_cast<double>(closures_) * student_tails(student, freedom);
        if (!(std::abs(student) <= std::abs(diagnosis_.student(pose.row, leg)))) {
          diagnosis_.student(pose.row, leg) = student;
          diagnosis_.student_p(pose.row, leg) = std::min(p_value, 1.0);
        }
      }
      outliers[k] = outliers[k] || p < alarm / static_cast<double>(system_.poses.size());
    }
    return {system_, outliers};
  }

  // Of legs of one chain all, of several chains those whose joints turn.
  std::vector<Index> turning_legs() const {
    std::vector<Index> turning;
    std::copy_if(
        system_.legs.begin(), system_.legs.end(), std::back_inserter(turning), [this](Index leg) {
          return !mechanism_.mixed() || is_angle(mechanism_.model(leg).info().active_joint);
        });
    return turning;
  }

  template <typename TermsOfLeg>
  void test_each_and_all(Suspect suspect, const std::vector<Index>& legs,
                         const TermsOfLeg& terms_of) {
    std::vector<std::pair<Index, Columns>> all;
    for (const Index leg : legs) {
      all.emplace_back(leg, terms_of(leg));
      diagnosis_.tests.push_back(term_test(suspect, leg, {all.back()}));
    }
    if (legs.size() > 1) {
      diagnosis_.tests.push_back(term_test(suspect, -1, all));
    }
  }

  // F test of terms of some legs' closures.
  ResidualTest term_test(Suspect suspect, Index leg,
                         const std::vector<std::pair<Index, Columns>>& terms) const {
    Index count = 0;
    for (const auto& [of_leg, columns] : terms) {
      count += static_cast<Index>(columns.size());
    }
    RowMatrix whitened = RowMatrix::Zero(system_.residual.size(), count);
    Index column = 0;
    for (const auto& [of_leg, columns] : terms) {
      for (const Vector& values : columns) {
        for (std::size_t k = 0; k < system_.poses.size(); ++k) {
          const WhitenedPose& pose = system_.poses[k];
          const Index row = row_of(k, of_leg);
          if (row >= 0) {
            Vector unit = Vector::Zero(pose.count());
            unit.segment(row - pose.first, closures_) =
                values.segment(pose.row * closures_, closures_);
            whitened.col(column).segment(pose.first, pose.count()) =
                lower_solution(pose.factor, unit);
          }
        }
        const double length = whitened.col(column).norm();
        whitened.col(column) /= length > 0 ? length : 1;
        ++column;
      }
    }
    // What is left of a term that the parameters nearly explain is made by the errors of the poses
    // at which the jacobian was taken.
    constexpr double kUnexplained = 5e-3;
    const ColumnSpace space = column_space(projection_.unexplained(whitened), kUnexplained);
    ResidualTest test{suspect, leg};
    if (space.rank() == 0) {
      return test;
    }
    const Vector values = space.basis.transpose() * projection_.residual();
    set_f(test, values.squaredNorm(), space.rank());
    test.size = closure_rms(space.basis * values, terms);
    return test;
  }

  // Root mean square, metres, of a whitened vector over the closures of the terms' legs.
  double closure_rms(const Vector& whitened,
                     const std::vector<std::pair<Index, Columns>>& terms) const {
    double sum = 0;
    Index count = 0;
    for (std::size_t k = 0; k < system_.poses.size(); ++k) {
      const WhitenedPose& pose = system_.poses[k];
      const Vector closures = pose.factor * whitened.segment(pose.first, pose.count());
      for (const auto& term : terms) {
        const Index row = row_of(k, term.first);
        if (row >= 0 && projection_.counts(k)) {
          sum += closures.segment(row - pose.first, closures_).squaredNorm();
          count += closures_;
        }
      }
    }
    return std::sqrt(sum / static_cast<double>(std::max<Index>(count, 1)));
  }

  void set_f(ResidualTest& test, double explained, Index terms) const {
    test.terms = terms;
    test.spare = projection_.degrees_of_freedom() - terms;
    const double rest = std::max(projection_.chi_square() - explained, 0.0);
    test.statistic =
        explained / static_cast<double>(terms) / rest * static_cast<double>(test.spare);
    test.p_value = f_tail(test.statistic, terms, test.spare);
  }

  void add_pairs(Suspect suspect, Index leg, Index other,
                 const std::vector<std::pair<Index, Index>>& pairs) {
    if (pairs.size() < 2) {
      return;
    }
    ResidualTest test{suspect, leg, other};
    test.statistic = projection_.quadratic_form(pairs);
    test.p_value = std::isfinite(test.statistic) ? normal_tails(test.statistic) : 1;
    diagnosis_.tests.push_back(test);
  }

  const Mechanism& mechanism_;
  Index closures_;  // of each leg
  const MeasurementSet& measurements_;
  const WhitenedClosures& system_;
  Diagnosis& diagnosis_;
  Projection projection_;
};

struct JudgedSystem {
  MeasurementSet at;  // most likely, from which the terms of the tests are made
  WhitenedClosures closures;
};

JudgedSystem judged_system(const Mechanism& mechanism, const MeasurementSet& measurements,
                           const MeasurementNoise& noise, const std::vector<Index>& legs) {
  const auto whitened = [&](const MeasurementSet& at) {
    return whiten_closures(mechanism, at, legs, PoseUse::all, noise);
  };
  LikelyMeasurements likely =
      most_likely(whitened(measurements), mechanism.pose_space(), measurements, noise);
  WhitenedClosures closures = whitened(likely.at);
  count_from_measured(likely, closures);
  return {std::move(likely.at), std::move(closures)};
}

// The closures of a pose have a common covariance that can be inverted; else leg by leg.
std::vector<JudgedSystem> systems_of(const Mechanism& mechanism, const MeasurementSet& measurements,
                                     const MeasurementNoise& noise) {
  try {
    return {judged_system(mechanism, measurements, noise, all_legs(mechanism.leg_count()))};
  } catch (const InvalidInput&) {
    std::vector<JudgedSystem> systems;
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      systems.push_back(judged_system(mechanism, measurements, noise, {leg}));
    }
    return systems;
  }
}

}  // namespace

Diagnosis diagnose(const Mechanism& estimate, const MeasurementSet& measurements,
                   const MeasurementNoise& noise, const std::vector<Index>& rejected,
                   bool turning_sensor, double alarm) {
  check_poses(estimate, measurements.poses);
  check_readings(estimate, measurements.poses.rows(), measurements.readings);
  Diagnosis diagnosis;
  const Index count = measurements.poses.rows();
  diagnosis.student.setConstant(count, estimate.leg_count(), kUntested);
  diagnosis.student_p.setConstant(count, estimate.leg_count(), kUntested);
  diagnosis.pose_p.setOnes(count);
  for (const auto& [at, system] : systems_of(estimate, measurements, noise)) {
    std::vector<bool> left_out;
    for (const WhitenedPose& pose : system.poses) {
      left_out.push_back(std::find(rejected.begin(), rejected.end(), pose.row) != rejected.end());
    }
    Diagnostician tests(estimate, at, system, left_out, alarm, diagnosis);
    if (tests.testable()) {
      tests.test_sensors(turning_sensor);
      tests.test_geometry();
      tests.test_order();
      tests.test_legs();
      // Of several closures `implicit` has weights that are not those of single rows.
      if (system.legs.size() > 1 && estimate.closures() == 1) {
        tests.test_estimators();
      }
    }
  }
  return diagnosis;
}

}  // namespace symkin
