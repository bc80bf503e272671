// SPDX-License-Identifier: MIT
#include "symkin/estimation/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "symkin/estimation/detail/estimator_contrast.hpp"
#include "symkin/estimation/detail/missing_terms.hpp"
#include "symkin/estimation/detail/projection.hpp"
#include "symkin/estimation/detail/whitened_closures.hpp"
#include "symkin/statistics/distributions.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

// Residuals this far below the declared noise, in variance, are those of arithmetic.
constexpr double kRounding = 1e-10;
constexpr double kUntested = std::numeric_limits<double>::quiet_NaN();

class Diagnostician {
 public:
  Diagnostician(const Mechanism& mechanism, const WhitenedClosures& system,
                const std::vector<bool>& left_out, double alarm, Diagnosis& diagnosis)
      : mechanism_(mechanism),
        closures_(mechanism.closures()),
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
    std::vector<Index> all = all_legs(static_cast<Index>(system_.legs.size()));
    test_each_and_all(Suspect::sensor_curvature, all, [](const Vector& readings) {
      return RowMatrix((readings.array() - middle(readings)).square());
    });
    if (turning) {
      // Of legs of one chain all, of several chains those whose joints turn.
      all.erase(std::remove_if(all.begin(), all.end(),
                               [this](Index place) {
                                 const LegModel& model = mechanism_.model(leg(place));
                                 return mechanism_.mixed() && !is_angle(model.info().active_joint);
                               }),
                all.end());
      test_each_and_all(Suspect::sensor_eccentricity, all, [](const Vector& readings) {
        RowMatrix terms(readings.size(), 2);
        terms << readings.array().cos(), readings.array().sin();
        return terms;
      });
    }
  }

  void test_geometry() {
    const RowMatrix coordinates = centred_coordinates();
    const Index dof = mechanism_.dof();
    const Index count = coordinates.rows();
    RowMatrix terms = RowMatrix::Zero(count * closures_, 2 * dof * closures_);
    for (Index closure = 0; closure < closures_; ++closure) {
      const auto rows = Eigen::seqN(closure, count, closures_);
      terms(rows, Eigen::seqN(2 * dof * closure, dof)) = coordinates;
      terms(rows, Eigen::seqN(2 * dof * closure + dof, dof)) = coordinates.cwiseAbs2();
    }
    const MissingTerms missing(system_, projection_, {system_.legs.size(), terms});
    for (Index place = 0; place < static_cast<Index>(system_.legs.size()); ++place) {
      const MissingTerms::Explained found = missing.explained({place});
      if (found.alone.size() == 0) {
        continue;
      }
      ResidualTest test = term_test(Suspect::geometry, leg(place), found);
      Index most = 0;
      found.alone.maxCoeff(&most);
      test.other = most % (2 * dof);
      diagnosis_.tests.push_back(test);
    }
  }

  void test_order() { add_form(Suspect::order, -1, -1, projection_.neighbours()); }

  void test_legs() {
    const auto count = static_cast<Index>(system_.legs.size());
    for (Index a = 0; a < count; ++a) {
      for (Index b = a + 1; b < count; ++b) {
        add_form(Suspect::legs, leg(a), leg(b), projection_.legs_together(a, b));
      }
    }
  }

  void test_estimators() {
    const auto [terms, square] = estimator_contrast(system_, projection_);
    if (terms > 0) {
      ResidualTest test{Suspect::estimators};
      set_f(test, square, terms);
      diagnosis_.tests.push_back(test);
    }
  }

 private:
  Index leg(Index place) const { return system_.legs[static_cast<std::size_t>(place)]; }

  static double middle(const Vector& readings) {
    const Vector finite =
        readings.unaryExpr([](double value) { return std::isfinite(value) ? value : kUntested; });
    return (finite.minCoeff<Eigen::PropagateNumbers>() +
            finite.maxCoeff<Eigen::PropagateNumbers>()) /
           2;
  }

  // Of the poses' tangent.
  RowMatrix centred_coordinates() const {
    const RowMatrix& poses = system_.at.poses;
    RowMatrix coordinates(poses.rows(), mechanism_.dof());
    for (Index i = 0; i < poses.rows(); ++i) {
      pose_difference(mechanism_.pose_space(), poses.row(i).data(),
                      poses.row(poses.rows() / 2).data(), coordinates.row(i).data());
    }
    const Eigen::RowVectorXd mean = coordinates.colwise().mean();
    coordinates.rowwise() -= mean;
    return coordinates;
  }

  // Terms of a leg's readings, one row a pose, as they show in its closures.
  RowMatrix through_sensor(Index place, const RowMatrix& terms) const {
    const Vector& by_reading = system_.of_legs[static_cast<std::size_t>(place)].by_reading;
    RowMatrix shown(by_reading.size(), terms.cols());
    for (Index i = 0; i < shown.rows(); ++i) {
      shown.row(i) = by_reading[i] * terms.row(i / closures_);
    }
    return shown;
  }

  // Every pose against the others; those that stand out are left out of what comes after.
  Projection judge_poses(const std::vector<bool>& left_out, double alarm) {
    Projection projection(system_, left_out);
    const Index dof = projection.degrees_of_freedom();
    const bool exact = projection.chi_square() <= kRounding * static_cast<double>(dof);
    const auto count = static_cast<Index>(system_.poses.size());
    std::vector<bool> outliers = left_out;
    for (Index k = 0; k < count && !exact && dof > 0; ++k) {
      const double p = judge_pose(projection, k);
      const auto at = static_cast<std::size_t>(k);
      outliers[at] = outliers[at] || p < alarm / static_cast<double>(count);
    }
    return outliers == left_out ? std::move(projection) : Projection(system_, outliers);
  }

  // The probability of residuals as large; and of each of its closures.
  double judge_pose(const Projection& projection, Index k) {
    const WhitenedPose& pose = system_.poses[static_cast<std::size_t>(k)];
    const Projection::Prediction predicted = projection.predicted(k);
    // A pose that counts is taken out of the chi-square that it is compared with.
    const bool counts = projection.counts(k);
    const Index dof = projection.degrees_of_freedom();
    const double chi_square = projection.chi_square();
    const Index n = predicted.rank;
    const double others = chi_square - (counts ? predicted.square : 0);
    const Index spare = dof - (counts ? n : 0);
    const double p = f_tail(
        predicted.square / static_cast<double>(n) / others * static_cast<double>(spare), n, spare);
    diagnosis_.pose_p[pose.row] = std::min(diagnosis_.pose_p[pose.row], p);
    const RowMatrix& units = pose.units;
    const RowMatrix directions = product(predicted.inverse, units);
    for (Index i = 0; i < pose.count(); ++i) {
      const Index leg = pose.legs[static_cast<std::size_t>(i / closures_)];
      const double value =
          units.col(i).dot(predicted.standardised) / std::sqrt(units.col(i).dot(directions.col(i)));
      const double rest = chi_square - (counts ? value * value : 0);
      const Index freedom = dof - (counts ? 1 : 0);
      const double student = value / std::sqrt(std::max(rest, 0.0) / static_cast<double>(freedom));
      // Of several closures of a leg the one that stands out most.
      const double p_value = static_cast<double>(closures_) * student_tails(student, freedom);
      if (!(std::abs(student) <= std::abs(diagnosis_.student(pose.row, leg)))) {
        diagnosis_.student(pose.row, leg) = student;
        diagnosis_.student_p(pose.row, leg) = std::min(p_value, 1.0);
      }
    }
    return p;
  }

  // `terms_of` the readings of a leg: a column a term.
  template <typename TermsOf>
  void test_each_and_all(Suspect suspect, const std::vector<Index>& places,
                         const TermsOf& terms_of) {
    if (places.empty()) {
      return;
    }
    std::vector<RowMatrix> terms;
    for (std::size_t i = 0; i < system_.legs.size(); ++i) {
      const Vector readings = system_.at.readings.col(system_.legs[i]);
      terms.push_back(through_sensor(static_cast<Index>(i), terms_of(readings)));
    }
    const MissingTerms missing(system_, projection_, std::move(terms));
    for (const Index place : places) {
      diagnosis_.tests.push_back(term_test(suspect, leg(place), missing.explained({place})));
    }
    if (places.size() > 1) {
      diagnosis_.tests.push_back(term_test(suspect, -1, missing.explained(places)));
    }
  }

  ResidualTest term_test(Suspect suspect, Index leg, const MissingTerms::Explained& found) const {
    ResidualTest test{suspect, leg};
    if (found.rank > 0) {
      set_f(test, found.square, found.rank);
      test.size = found.rms;
    }
    return test;
  }

  void set_f(ResidualTest& test, double explained, Index terms) const {
    test.terms = terms;
    test.spare = projection_.degrees_of_freedom() - terms;
    const double rest = std::max(projection_.chi_square() - explained, 0.0);
    test.statistic =
        explained / static_cast<double>(terms) / rest * static_cast<double>(test.spare);
    test.p_value = f_tail(test.statistic, terms, test.spare);
  }

  void add_form(Suspect suspect, Index leg, Index other, const std::optional<double>& statistic) {
    if (statistic) {
      ResidualTest test{suspect, leg, other};
      test.statistic = *statistic;
      test.p_value = std::isfinite(test.statistic) ? normal_tails(test.statistic) : 1;
      diagnosis_.tests.push_back(test);
    }
  }

  const Mechanism& mechanism_;
  Index closures_;  // of each leg
  const WhitenedClosures& system_;
  Diagnosis& diagnosis_;
  Projection projection_;
};

// The closures of a pose have a common covariance that can be inverted; else leg by leg.
std::vector<WhitenedClosures> systems_of(const Mechanism& mechanism,
                                         const MeasurementSet& measurements,
                                         const MeasurementNoise& noise) {
  const auto whitened = [&](const std::vector<Index>& legs) {
    return whiten_closures(mechanism, measurements, legs, noise, LinearisedAt::likely);
  };
  const std::vector<Index> all = all_legs(mechanism.leg_count());
  std::vector<WhitenedClosures> systems;
  try {
    systems.push_back(whitened(all));
  } catch (const InvalidInput&) {
    for (const Index leg : all) {
      systems.push_back(whitened({leg}));
    }
  }
  return systems;
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
  for (const WhitenedClosures& system : systems_of(estimate, measurements, noise)) {
    std::vector<bool> left_out;
    for (const WhitenedPose& pose : system.poses) {
      left_out.push_back(std::find(rejected.begin(), rejected.end(), pose.row) != rejected.end());
    }
    Diagnostician tests(estimate, system, left_out, alarm, diagnosis);
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
