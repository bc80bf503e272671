// SPDX-License-Identifier: MIT
#include "symkin/kinematics/inverse_kinematics.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include "symkin/chains/detail/kernels.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/scale_rows.hpp"

namespace symkin {
namespace {

// Home readings are above this share of a turn: robots whose sensors show half a turn at home stay
// on one side of the cut whatever their errors are.
constexpr double kLeastHome = -160.0 / 360;

double sensor_gain(const Mechanism& mechanism, Index leg) {
  return mechanism.model(leg).sensor_gain(mechanism.leg(leg).parameters, 0);
}

// Kernels count from a sensor's zero, so that half a turn from home is at most a turn away.
void count_from_home(const Mechanism& mechanism, Index leg,
                     Eigen::Ref<Vector, 0, Eigen::InnerStride<>> readings) {
  const double home = mechanism.leg(leg).home_reading;
  if (home == 0) {
    return;
  }
  const double turn = 2 * kPi / std::abs(sensor_gain(mechanism, leg));
  const auto from_home = readings.array() - home;
  readings.array() +=
      turn * ((from_home < -turn / 2).cast<double>() - (from_home > turn / 2).cast<double>());
}

template <typename T, std::size_t N>
using Gram = std::array<std::array<T, N>, N>;  // J'J, the lower triangle

template <typename T>
struct Eigenvalues {
  T smallest, largest;
};

Eigenvalues<double> eigenvalues(const Gram<double, 2>& gram) {
  const double mean = (gram[0][0] + gram[1][1]) / 2;
  const double apart = std::hypot((gram[0][0] - gram[1][1]) / 2, gram[1][0]);
  return {mean - apart, mean + apart};
}

template <std::size_t N>
Eigenvalues<double> eigenvalues(const Gram<double, N>& gram) {
  constexpr auto kSize = static_cast<Index>(N);
  const Vector values =
      symmetric_eigenvalues(Eigen::Map<const RowMatrix>(&gram[0][0], kSize, kSize));
  return {values[0], values[kSize - 1]};
}

// In closed form, accurate enough for a condition number of some thousands: about their mean they
// are the roots 2 sqrt(p) cos(angle + 2 pi k / 3) of x^3 - 3 p x - 2 q, cos(3 angle) = q / p^1.5.
template <typename T>
Eigenvalues<T> closed_form(const Gram<T, 3>& gram) {
  using std::atan2;
  using std::max;
  using std::sqrt;
  const T mean = (gram[0][0] + gram[1][1] + gram[2][2]) * (1.0 / 3);
  const T a = gram[0][0] - mean;
  const T b = gram[1][1] - mean;
  const T c = gram[2][2] - mean;
  const T d = gram[1][0] * gram[1][0];
  const T e = gram[2][0] * gram[2][0];
  const T f = gram[2][1] * gram[2][1];
  const T p = (a * a + b * b + c * c + 2.0 * (d + e + f)) * (1.0 / 6);
  const T q = 0.5 * (a * b * c - a * f - b * e - c * d) + gram[1][0] * gram[2][0] * gram[2][1];
  // Of two zeros xsimd's is not a number.
  const T threefold = atan2(sqrt(max(p * p * p - q * q, T(0.0))), q + 1e-300);
  T cosine, sine;
  Lanes<T>::cosine_sine(threefold * (1.0 / 3), cosine, sine);
  const T root = sqrt(p);
  return {mean - root * (cosine + std::sqrt(3.0) * sine), mean + 2.0 * root * cosine};
}

// Several poses side by side where there is a closed form.
template <std::size_t Dof>
Vector conditions(const RowMatrix& jacobian, ConstVector scales, Index position, double length) {
  using std::sqrt;
  using T = std::conditional_t<Dof == 3, chains::Scalar<xsimd::default_arch>, double>;
  const T infinity(std::numeric_limits<double>::infinity());
  Vector conditions(jacobian.rows());
  for (Index first = 0; first < jacobian.rows(); first += Lanes<T>::kCount) {
    const detail::LaneRows<T> rows(first, jacobian.rows());
    Gram<T, Dof> gram{};
    const double* column = jacobian.data();
    for (const double of_row : scales) {
      const double scale = of_row / scales[0];
      std::array<T, Dof> row;
      for (std::size_t i = 0; i < Dof; ++i) {
        row[i] = rows.read(column++, jacobian.cols()) *
                 T(static_cast<Index>(i) < position ? scale : scale / length);
        for (std::size_t j = 0; j <= i; ++j) {
          gram[i][j] = gram[i][j] + row[i] * row[j];
        }
      }
    }
    Eigenvalues<T> of_gram;
    if constexpr (Dof == 3) {
      of_gram = closed_form(gram);
    } else {
      of_gram = eigenvalues(gram);
    }
    const auto& [smallest, largest] = of_gram;
    rows.write(Lanes<T>::select(smallest <= T(0.0), infinity, sqrt(largest / smallest)),
               conditions.data(), 1);
  }
  return conditions;
}

// Of fewer rows than degrees of freedom: how near the legs are to binding the platform twice in one
// way. What they leave it is not seen.
Vector conditions_of_few(const RowMatrix& jacobian, ConstVector scales, Index dof, Index position,
                         double length) {
  Vector conditions(jacobian.rows());
  for (Index i = 0; i < jacobian.rows(); ++i) {
    RowMatrix rows = Eigen::Map<const RowMatrix>(jacobian.row(i).data(), scales.size(), dof);
    scale_rows(rows, scales / scales[0]);
    rows.rightCols(dof - position) /= length;
    const Vector values = symmetric_eigenvalues(product(rows, rows.transpose()));
    conditions[i] = values[0] > 0 ? std::sqrt(values[values.size() - 1] / values[0])
                                  : std::numeric_limits<double>::infinity();
  }
  return conditions;
}

template <int N>
double determinant(const Eigen::Matrix<double, N, N, Eigen::RowMajor>& matrix) {
  if constexpr (N <= 3) {
    return matrix.determinant();
  } else {
    return symkin::determinant(matrix);
  }
}

template <int Dof>
double root_determinant(const double* jacobian, Index count) {
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Dof, Eigen::RowMajor>;
  const Eigen::Map<const Jacobian> rows(jacobian, count, Dof);
  if (count == Dof) {
    return determinant<Dof>(rows);
  }
  return std::sqrt(std::max(0.0, determinant<Dof>(rows.transpose().lazyProduct(rows))));
}

PoseDerivatives linearise_all(const Mechanism& mechanism, ConstRows poses, ConstRows readings) {
  check_poses(mechanism, poses);
  check_readings(mechanism, poses.rows(), readings);
  return linearise_pose(mechanism, poses, readings);
}

// Implicit function theorem: dg/dpose = -(dh/dpose) / (dh/dpsi), of each leg's first closure; the
// others, and those of legs without one, without the reading.
RowMatrix by_readings(const Mechanism& mechanism, PoseDerivatives all) {
  const Index closures = mechanism.closures();
  all.eliminate_reading(closures);
  const Index count = std::max<Index>(all.by_reading.cols(), 1);
  const Index dof = all.by_pose.cols() / count;
  const bool all_read = mechanism.reading_count() == mechanism.leg_count();
  for (Index i = 0; i < all.by_reading.size(); i += closures) {
    if (!all_read && !mechanism.shows_reading(i % count)) {
      continue;
    }
    double* row = all.by_pose.data() + i * dof;
    const double factor = -1 / all.by_reading.data()[i];
    for (Index k = 0; k < dof; ++k) {
      *row++ *= factor;
    }
  }
  return std::move(all.by_pose);
}

}  // namespace

RowMatrix inverse_kinematics(const Mechanism& mechanism, ConstRows poses) {
  check_poses(mechanism, poses);
  RowMatrix readings(poses.rows(), mechanism.leg_count());
  if (const ChainModel* const chain = mechanism.chain()) {
    readings = chain->inverse_kinematics(mechanism.leg_values(), poses);
    for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
      count_from_home(mechanism, leg, readings.col(leg));
    }
    return readings;
  }
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    readings.col(leg) = inverse_kinematics(mechanism, leg, poses);
  }
  return readings;
}

Vector inverse_kinematics(const Mechanism& mechanism, Index leg, ConstRows poses) {
  Vector readings(poses.rows());
  const Leg& which = mechanism.leg(leg);
  mechanism.model(leg).inverse_kinematics(which.parameters, which.working_mode, poses, readings);
  count_from_home(mechanism, leg, readings);
  return readings;
}

Mechanism counted_from(const Mechanism& mechanism, ConstVector home) {
  std::vector<Leg> legs = mechanism.legs();
  for (Leg& leg : legs) {
    leg.home_reading = 0;
  }
  const Mechanism plain = mechanism.with_legs(legs);
  const RowMatrix pose = home.transpose();
  const RowMatrix readings = inverse_kinematics(plain, pose);
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const auto leg = static_cast<Index>(i);
    const double reading = readings(0, leg);
    if (is_angle(plain.model(leg).info().active_joint) && std::isfinite(reading)) {
      const double turn = 2 * kPi / std::abs(sensor_gain(plain, leg));
      legs[i].home_reading = reading < kLeastHome * turn ? reading + turn : reading;
    }
  }
  return plain.with_legs(std::move(legs));
}

RowMatrix reach_margin(const Mechanism& mechanism, ConstRows poses) {
  check_poses(mechanism, poses);
  if (const ChainModel* const chain = mechanism.chain()) {
    return chain->reach_margin(mechanism.leg_values(), poses);
  }
  RowMatrix margins(poses.rows(), mechanism.leg_count());
  Vector of_leg(poses.rows());
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    mechanism.model(leg).reach_margin(mechanism.leg(leg).parameters, poses, of_leg);
    margins.col(leg) = of_leg;
  }
  return margins;
}

Vector closure(const Mechanism& mechanism, Index leg, ConstRows poses, ConstVector readings) {
  check_poses(mechanism, poses);
  check_leg_readings(poses.rows(), readings);
  Vector values(poses.rows() * mechanism.closures());
  mechanism.model(leg).closure(mechanism.leg(leg).parameters, poses, readings, values);
  return values;
}

ClosureRows linearise(const Mechanism& mechanism, Index leg, ConstRows poses,
                      ConstVector readings) {
  check_poses(mechanism, poses);
  check_leg_readings(poses.rows(), readings);
  ClosureRows rows;
  mechanism.model(leg).linearise(mechanism.leg(leg).parameters, poses, readings, rows);
  return rows;
}

PoseDerivatives linearise_pose(const Mechanism& mechanism, ConstRows poses,
                               const RowMatrix& readings) {
  if (const ChainModel* const chain = mechanism.chain()) {
    return chain->linearise_pose(mechanism.leg_values(), poses, readings);
  }
  const Index dof = mechanism.dof();
  PoseDerivatives all;
  all.closure.resize(poses.rows(), mechanism.leg_count());
  all.by_pose.resize(poses.rows(), mechanism.leg_count() * dof);
  all.by_reading.resize(poses.rows(), mechanism.leg_count());
  ClosureRows rows;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    mechanism.model(leg).linearise_pose(mechanism.leg(leg).parameters, poses, readings.col(leg),
                                        rows);
    all.closure.col(leg) = rows.closure;
    all.by_pose.middleCols(leg * dof, dof) = rows.by_pose;
    all.by_reading.col(leg) = rows.by_reading;
  }
  return all;
}

RowMatrix parameter_jacobian(const Mechanism& mechanism, Index leg, ConstRows poses) {
  check_poses(mechanism, poses);
  ClosureRows rows = linearise(mechanism, leg, poses, inverse_kinematics(mechanism, leg, poses));
  const Index closures = mechanism.closures();
  if (closures > 1) {
    const auto first = Eigen::seqN(Index{0}, poses.rows(), closures);
    rows.by_parameters = RowMatrix(rows.by_parameters(first, kAll));
    rows.by_reading = Vector(rows.by_reading(first));
  }
  // dg/dparam = -(dh/dparam) / (dh/dpsi).
  if (mechanism.model(leg).info().read) {
    scale_rows(rows.by_parameters, -rows.by_reading.cwiseInverse());
  }
  return std::move(rows.by_parameters);
}

RowMatrix pose_jacobian(const Mechanism& mechanism, ConstRows poses) {
  RowMatrix closed = closed_pose_jacobian(mechanism, poses, inverse_kinematics(mechanism, poses));
  const Index closures = mechanism.closures();
  if (closures == 1) {
    return closed;
  }
  const Index dof = mechanism.dof();
  RowMatrix jacobian(poses.rows(), mechanism.leg_count() * dof);
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    jacobian.middleCols(leg * dof, dof) = closed.middleCols(leg * closures * dof, dof);
  }
  return jacobian;
}

RowMatrix closed_pose_jacobian(const Mechanism& mechanism, ConstRows poses, ConstRows readings) {
  return by_readings(mechanism, linearise_all(mechanism, poses, readings));
}

Vector row_scales(const Mechanism& mechanism, double characteristic_length) {
  const Index closures = mechanism.closures();
  const auto turns = [&](Index leg) { return is_angle(mechanism.model(leg).info().active_joint); };
  bool alike = true;
  for (Index leg = 1; leg < mechanism.leg_count(); ++leg) {
    alike = alike && (turns(leg) == turns(0) || !mechanism.shows_reading(leg * closures));
  }
  Vector scales = Vector::Ones(mechanism.leg_count() * closures);
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    scales[leg * closures] =
        sensor_gain(mechanism, leg) * (turns(leg) && !alike ? characteristic_length : 1);
  }
  return scales;
}

SingularityMeasures singularity_measures(const Mechanism& mechanism, ConstRows poses,
                                         double characteristic_length) {
  if (!(characteristic_length > 0)) {
    throw InvalidInput("characteristic_length = " + std::to_string(characteristic_length) +
                       " m; expected a positive length");
  }
  const Index closures = mechanism.closures();
  PoseDerivatives all = linearise_all(mechanism, poses, inverse_kinematics(mechanism, poses));
  SingularityMeasures measures;
  measures.serial = all.by_reading(kAll, Eigen::seqN(Index{0}, mechanism.leg_count(), closures));
  const RowMatrix jacobian = by_readings(mechanism, std::move(all));
  measures.parallel.resize(poses.rows());
  const Vector scales = row_scales(mechanism, characteristic_length);
  measures.condition =
      pose_conditions(jacobian, scales, mechanism.pose_space(), characteristic_length);
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    if (mechanism.shows_reading(leg * closures)) {
      measures.serial.col(leg) /= sensor_gain(mechanism, leg);
    } else {
      measures.serial.col(leg).setOnes();  // never singular
    }
  }
  for (Index i = 0; i < poses.rows(); ++i) {
    measures.parallel[i] = pose_determinant(jacobian.row(i).data(), scales.size(), mechanism.dof());
  }
  return measures;
}

Vector pose_conditions(const RowMatrix& jacobian, ConstVector scales, PoseSpace space,
                       double characteristic_length) {
  const Index position = position_size(space);
  if (scales.size() < degrees_of_freedom(space)) {
    return conditions_of_few(jacobian, scales, degrees_of_freedom(space), position,
                             characteristic_length);
  }
  switch (degrees_of_freedom(space)) {
    case 2:
      return conditions<2>(jacobian, scales, position, characteristic_length);
    case 3:
      return conditions<3>(jacobian, scales, position, characteristic_length);
    case 4:
      return conditions<4>(jacobian, scales, position, characteristic_length);
    default:
      return conditions<6>(jacobian, scales, position, characteristic_length);
  }
}

double pose_determinant(const double* jacobian, Index rows, Index dof) {
  if (rows < dof) {
    const Eigen::Map<const RowMatrix> few(jacobian, rows, dof);
    const Vector values = symmetric_eigenvalues(product(few, few.transpose()));
    return std::sqrt(std::max(0.0, values.prod()));
  }
  switch (dof) {
    case 2:
      return root_determinant<2>(jacobian, rows);
    case 3:
      return root_determinant<3>(jacobian, rows);
    case 4:
      return root_determinant<4>(jacobian, rows);
    default:
      return root_determinant<6>(jacobian, rows);
  }
}

}  // namespace symkin
