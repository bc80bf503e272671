// SPDX-License-Identifier: MIT
#include "symkin/estimation/detail/latent_poses.hpp"

#include <algorithm>
#include <cmath>

#include "symkin/estimation/detail/factors.hpp"
#include "symkin/model/chain_model.hpp"
#include "symkin/model/sensor.hpp"
#include "symkin/support/dense.hpp"

namespace symkin {
namespace {

std::size_t at_index(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

LatentPoses::LatentPoses(const Mechanism& mechanism, const Observations& observations,
                         const Layout& layout, const Setup& setup)
    : mechanism_(mechanism),
      observations_(observations),
      list_(setup),
      own_(mechanism.parameter_count()),
      own_free_(at_index(mechanism.leg_count())),
      column_count_(layout.columns()),
      directions_(factors::kOwn),
      legs_(own_free_.size()),
      whole_(legs_.size()),
      by_free_(legs_.size()),
      packs_(legs_.size()),
      of_legs_(legs_.size()) {
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    for (Index i = 0; i < UnknownList::kCurvature; ++i) {
      if (layout.is_free(list_.curvature(leg) + i)) {
        curved_ = true;
        own_ = mechanism.parameter_count() + UnknownList::kCurvature;
      }
    }
  }
  const Index before = list_.leg(1);  // the slopes
  if (observations.leg_covariates.cols() > 0) {
    own_ = before + setup.leg_slopes.cols();
  }
  const auto scalar_of = [&](Index leg, Index i) {
    return i < before ? list_.leg(leg) + i : list_.leg_slope(leg) + i - before;
  };
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    std::vector<Index>& own = own_free_[at_index(leg)];
    own.reserve(at_index(own_));
    for (Index i = 0; i < own_; ++i) {
      if (layout.is_free(scalar_of(leg, i))) {
        own.push_back(i);
      }
    }
    width_ = std::max(width_, static_cast<Index>(own.size()));
  }
  const Index behind = list_.size() - list_.base();  // the legs
  free_.reserve(at_index(mechanism.leg_count() * width_ + behind));
  shared_of_.reserve(at_index(behind));
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const std::vector<Index>& own = own_free_[at_index(leg)];
    whole_[at_index(leg)] = static_cast<Index>(own.size()) == own_;
    for (std::size_t i = 0; i < at_index(width_); ++i) {
      free_.push_back(i < own.size() ? scalar_of(leg, own[i]) : -1);
    }
  }
  for (Index scalar = list_.base(); scalar < list_.size(); ++scalar) {
    const bool of_leg = scalar >= list_.leg_slope(0) && scalar < list_.base_slope(0);
    const bool free = !of_leg && layout.is_free(scalar);
    shared_of_.push_back(free ? shared_++ : -1);
    if (free) {
      free_.push_back(scalar);
      const bool single = scalar >= list_.point(0) && scalar < list_.base_slope(0);
      directions_ = std::max(directions_, single ? factors::kBase : factors::kDirections);
    }
  }
  may_pack_ = own_ == mechanism.parameter_count() && mechanism.closures() == 1;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    may_pack_ = may_pack_ && whole_[at_index(leg)] &&
                dynamic_cast<const KernelModel*>(&mechanism.model(leg)) != nullptr;
  }
  tie(layout);
  plan_ = planned_rows(mechanism, observations, setup, directions_ < factors::kDirections);
  const Index lanes = latent_kernels().lanes;
  const Index packs = (observations.count() + lanes - 1) / lanes;
  set_places();
  given_ = observations.readings.values.unaryExpr(
      [](double value) { return std::isfinite(value) ? value : 0; });
  room_.setZero(packs * places_.size * lanes);  // rows that no pose has stay so
  chi_squares_.setZero(observations.count());
  clear_.setZero(observations.count());
}

void LatentPoses::tie(const Layout& layout) {
  shares_.clear();
  shares_.reserve(free_.size() + layout.ties.size());
  first_share_.assign(1, 0);
  first_share_.reserve(free_.size() + 1);
  for (const Index scalar : free_) {
    const Index column = scalar < 0 ? -1 : layout.column[at_index(scalar)];
    if (column >= 0) {
      shares_.push_back({column, 1});
    }
    for (const Tie& tie : layout.ties) {
      if (tie.scalar == scalar) {
        shares_.push_back({tie.column, tie.factor});
      }
    }
    first_share_.push_back(shares_.size());
  }
}

Index LatentPoses::count(Index pose) const {
  return plan_.taken[at_index(pose)] - mechanism_.dof();
}

void LatentPoses::set_places() {
  const Index m = plan_.variances.cols(), dof = mechanism_.dof(), r = m - dof;
  const Index bound = mechanism_.leg_count() * mechanism_.closures();
  const auto place = [&](Index count) {
    const Index here = places_.size;
    places_.size += count;
    return here;
  };
  places_.misfits = place(m);
  places_.variances = place(m);
  places_.by_pose = place(m * dof);
  places_.by_unknowns = place(bound * width_);
  places_.by_shared = place((m - bound) * shared_);
  places_.reflectors = place(m * dof);
  places_.diagonal = place(dof);
  places_.factors = place(dof);
  places_.lengths = place(m);
  places_.conditions = place(m * r);
  places_.rho = place(r);
  places_.jacobian = place(r * shared_);
}

LatentRows LatentPoses::kernel_rows(const double* poses, const double* errors) {
  for (std::size_t leg = 0; leg < of_legs_.size(); ++leg) {
    const ClosureRows& rows = legs_[leg];
    const RowMatrix& by_free = whole_[leg] ? rows.by_parameters : by_free_[leg];
    of_legs_[leg] = {rows.closure.data(), by_free.data(), rows.by_pose.data(),
                     rows.by_reading.data(), is_packed_ ? packs_[leg].data() : nullptr};
  }
  return {observations_.count(),
          mechanism_.leg_count(),
          mechanism_.closures(),
          mechanism_.dof(),
          width_,
          plan_.variances.cols(),
          shared_,
          position_size(mechanism_.pose_space()),
          plan_.basis,
          of_legs_.data(),
          errors,
          plan_.variances.data(),
          plan_.observations.data(),
          static_cast<Index>(plan_.observations.size()),
          plan_.values.data(),
          plan_.values.cols(),
          poses,
          coordinate_count(mechanism_.pose_space()),
          bases_.data(),
          base_turns_.rows() > 0 ? bases_.cols() : 0,
          base_turns_.data(),
          target_.data(),
          scalars_.data(),
          observations_.base_covariates.data(),
          observations_.base_covariates.cols(),
          list_.base_slope(0) - list_.base(),
          shared_of_.data(),
          pose_slots(mechanism_.pose_space()).data(),
          directions_,
          places_,
          room_.data(),
          chi_squares_.data(),
          clear_.data()};
}

// Numbers of one pose in the room of its pack.
class LatentPoses::OfPose {
 public:
  OfPose(const LatentPoses& poses, Index pose)
      : lanes_(latent_kernels().lanes),
        first_(&poses.room_[pose / lanes_ * poses.places_.size * lanes_ + pose % lanes_]) {}
  double operator()(Index place, Index i) const { return first_[(place + i) * lanes_]; }

 private:
  Index lanes_;
  const double* first_;
};

void LatentPoses::linearise_leg(const Setup& setup, const RowMatrix& poses, const RowMatrix& errors,
                                Index leg, const std::vector<bool>& aside) {
  const LegModel& model = mechanism_.model(leg);
  ClosureRows& rows = legs_[at_index(leg)];
  const Index closures = model.info().closures;
  const Index parameters = mechanism_.parameter_count();
  own_parameters_ = setup.parameters.row(leg);
  readings_ = given_.col(leg) + errors.col(leg);
  Vector growths;
  if (observations_.leg_covariates.cols() > 0) {
    readings_ -= setup.reading_shifts(leg, observations_.leg_covariates);
    growths = setup.growths(leg, observations_.leg_covariates);
  }
  const bool curved = curved_ || !setup.curvature.row(leg).isZero(0);
  Vector bent;
  if (curved) {
    bent = readings_.unaryExpr([&](double psi) { return setup.model_reading(leg, psi); });
  }
  const Vector& shown = curved ? bent : readings_;
  if (growths.size() == 0 || growths.isZero(0)) {
    model.linearise(own_parameters_, poses, shown, rows);
  } else {
    linearise_growing(model, own_parameters_, growths, poses, shown, rows);
  }
  if (own_ > parameters) {
    rows.by_parameters.conservativeResize(Eigen::NoChange, own_);
    rows.by_parameters.rightCols(own_ - parameters).setZero();
  }
  if (curved) {
    const CurvedSensor sensor = setup.sensor(leg);
    const Index geometry = parameters - LinearSensor::kParameters;
    for (Index at = 0; at < rows.closure.size(); ++at) {
      const double psi = readings_[at / closures];
      const double by_joint = rows.by_reading[at] / sensor.straight.gain;
      const auto by_sensor = CurvedSensor::by_parameters(psi);
      rows.by_reading[at] = by_joint * sensor.by_reading(psi);
      for (Index i = geometry; i < std::min(own_, list_.leg(1)); ++i) {
        rows.by_parameters(at, i) = by_joint * by_sensor[at_index(i - geometry)];
      }
    }
  }
  if (growths.size() > 0) {
    add_covariates(setup, growths, leg, rows);
  }
  // The errors of a leg's rows are independent then: the reading is in one of them.
  if (closures > 1) {
    rows.eliminate_reading(closures);
  }
  for (Index i = 0; i < poses.rows(); ++i) {
    if (aside[at_index(i)] || plan_.variances(i, leg * closures) < 0) {
      rows.closure.segment(i * closures, closures).setZero();
      rows.by_parameters.middleRows(i * closures, closures).setZero();
      rows.by_pose.middleRows(i * closures, closures).setZero();
      rows.by_reading.segment(i * closures, closures).setZero();
    }
  }
  if (!whole_[at_index(leg)]) {
    keep_free(leg);
  }
}

void LatentPoses::keep_free(Index leg) {
  const RowMatrix& by_own = legs_[at_index(leg)].by_parameters;
  const std::vector<Index>& own = own_free_[at_index(leg)];
  RowMatrix& by_free = by_free_[at_index(leg)];
  by_free.setZero(by_own.rows(), width_);
  for (Index row = 0; row < by_own.rows(); ++row) {
    for (std::size_t i = 0; i < own.size(); ++i) {
      by_free(row, static_cast<Index>(i)) = by_own(row, own[i]);
    }
  }
}

// Lanes beyond the last pose have it once more.
void LatentPoses::pack(const RowMatrix& poses) {
  const Index lanes = latent_kernels().lanes, last = poses.rows() - 1;
  packed_poses_.resize(at_index((last / lanes + 1) * lanes * poses.cols()));
  double* to = packed_poses_.data();
  for (Index first = 0; first <= last; first += lanes) {
    for (Index k = 0; k < poses.cols(); ++k) {
      for (Index i = first; i < first + lanes; ++i) {
        *to++ = poses(std::min(i, last), k);
      }
    }
  }
}

void LatentPoses::linearise_packs(const Setup& setup, const RowMatrix& errors, Index leg,
                                  const std::vector<bool>& aside) {
  const Index lanes = latent_kernels().lanes, width = own_ + mechanism_.dof() + 2;
  const Index last = observations_.count() - 1, packs = last / lanes + 1;
  packed_parameters_.clear();
  for (Index k = 0; k < own_; ++k) {
    packed_parameters_.insert(packed_parameters_.end(), at_index(lanes), setup.parameters(leg, k));
  }
  packed_readings_.resize(at_index(packs * lanes));
  for (Index i = 0; i < packs * lanes; ++i) {
    packed_readings_[at_index(i)] = given_(std::min(i, last), leg) + errors(std::min(i, last), leg);
  }
  std::vector<double>& rows = packs_[at_index(leg)];
  rows.resize(at_index(packs * lanes * width));
  mechanism_.model(leg).linearise_lanes(
      {lanes, packs, packed_parameters_.data(), packed_poses_.data(), packed_readings_.data()},
      rows.data());
  for (Index i = 0; i < packs * lanes; ++i) {
    const Index row = std::min(i, last);
    if (aside[at_index(row)] || plan_.variances(row, leg) < 0) {
      for (Index k = 0; k < width; ++k) {
        rows[at_index((i / lanes * width + k) * lanes + i % lanes)] = 0;
      }
    }
  }
}

double LatentPoses::packed(Index pose, Index leg, Index i) const {
  const Index lanes = latent_kernels().lanes, width = own_ + mechanism_.dof() + 2;
  return packs_[at_index(leg)][at_index((pose / lanes * width + i) * lanes + pose % lanes)];
}

ClosureRows LatentPoses::leg(Index leg) const {
  if (!is_packed_) {
    return legs_[at_index(leg)];
  }
  const Index count = observations_.count(), dof = mechanism_.dof();
  RowMatrix all(count, own_ + dof + 2);
  for (Index i = 0; i < all.size(); ++i) {
    all.data()[i] = packed(i / all.cols(), leg, i % all.cols());
  }
  return {all.col(0), all.middleCols(1, own_), all.middleCols(1 + own_, dof), all.rightCols<1>()};
}

// Every pose with lengths of its own, by the lengths as the setup has them.
void LatentPoses::linearise_growing(const LegModel& model, const Vector& parameters,
                                    const Vector& growths, const RowMatrix& poses,
                                    const Vector& shown, ClosureRows& rows) {
  const ChainInfo& chain = model.info();
  const Index closures = chain.closures;
  rows.resize(poses.rows() * closures, parameters.size(), mechanism_.dof());
  ClosureRows one;
  for (Index i = 0; i < poses.rows(); ++i) {
    Vector scales = Vector::Ones(parameters.size());
    for (Index k = 0; k < scales.size(); ++k) {
      if (grows(chain, chain.parameters[at_index(k)])) {
        scales[k] += growths[i];
      }
    }
    model.linearise(parameters.cwiseProduct(scales), poses.middleRows(i, 1), shown.segment(i, 1),
                    one);
    rows.closure.segment(i * closures, closures) = one.closure;
    rows.by_parameters.middleRows(i * closures, closures) = one.by_parameters * scales.asDiagonal();
    rows.by_pose.middleRows(i * closures, closures) = one.by_pose;
    rows.by_reading.segment(i * closures, closures) = one.by_reading;
  }
}

// Derivatives by the slopes, behind those by the parameters and the curvature.
void LatentPoses::add_covariates(const Setup& setup, const Vector& growths, Index leg,
                                 ClosureRows& rows) {
  const ChainInfo& chain = mechanism_.model(leg).info();
  Vector lengths = Vector::Zero(setup.parameters.cols());
  for (Index k = 0; k < lengths.size(); ++k) {
    if (grows(chain, chain.parameters[at_index(k)])) {
      lengths[k] = setup.parameters(leg, k);
    }
  }
  for (Index at = 0; at < rows.closure.size(); ++at) {
    const Index pose = at / chain.closures;
    for (std::size_t k = 0; k < setup.leg_covariates.size(); ++k) {
      const auto column = static_cast<Index>(k);
      const double covariate =
          observations_.leg_covariates(pose, column * mechanism_.leg_count() + leg);
      const double by_shift =
          setup.leg_covariates[k].of == LegCovariate::Of::reading
              ? -rows.by_reading[at]
              : rows.by_parameters.row(at).head(lengths.size()).dot(lengths) / (1 + growths[pose]);
      rows.by_parameters(at, own_ - static_cast<Index>(setup.leg_covariates.size()) + column) =
          covariate * by_shift;
    }
  }
}

void LatentPoses::eliminate(const Setup& setup, const RowMatrix& poses, const RowMatrix& errors,
                            const std::vector<bool>& aside) {
  is_packed_ = may_pack_ && setup.curvature.isZero(0);
  if (is_packed_) {
    pack(poses);
  }
  for (Index leg = 0; leg < mechanism_.leg_count(); ++leg) {
    if (is_packed_) {
      linearise_packs(setup, errors, leg, aside);
    } else {
      linearise_leg(setup, poses, errors, leg, aside);
    }
  }
  const RowMatrix& covariates = observations_.base_covariates;
  base_turns_.resize(covariates.cols() > 0 ? poses.rows() : 0, 18);
  bases_.resize(std::max(base_turns_.rows(), Index{1}), 12);
  write_frame(setup.base, bases_.data());
  for (Index i = 0; i < base_turns_.rows(); ++i) {
    write_frame(setup.base_at(covariates.row(i)), &bases_(i, 0));
    const Eigen::Vector3d turn = (covariates.row(i) * setup.base_slopes).tail<3>().transpose();
    using ByRows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Eigen::Map<ByRows> rotation(&base_turns_(i, 0)), by_turn(&base_turns_(i, 9));
    rotation = rotation_of(turn);
    by_turn = left_jacobian(turn);
  }
  target_.resize(12);
  write_frame(setup.target, target_.data());
  scalars_.resize(setup.points.size() + setup.anchors.size() + setup.plane.size() +
                  setup.zeros.size());
  scalars_ << Eigen::Map<const Vector>(setup.points.data(), setup.points.size()),
      Eigen::Map<const Vector>(setup.anchors.data(), setup.anchors.size()), setup.plane,
      setup.zeros;
  latent_kernels().eliminate(kernel_rows(poses.data(), errors.data()));
}

void LatentPoses::add_to(NormalEquations& equations, const Vector& weights, bool gradient_alone) {
  const auto size = static_cast<Index>(free_.size());
  const Index squares = gradient_alone ? 0 : size;
  RowMatrix information(squares, squares);
  Vector gradient(size);
  latent_kernels().add(kernel_rows(nullptr, nullptr), weights.data(),
                       gradient_alone ? nullptr : information.data(), gradient.data());
  for (Index i = 0; i < size; ++i) {
    for (const Share& row : shares(i)) {
      equations.gradient[row.column] += row.factor * gradient[i];
      for (Index j = 0; j <= i && !gradient_alone; ++j) {
        for (const Share& column : shares(j)) {
          const double value = row.factor * column.factor * information(i, j);
          equations.information(row.column, column.column) += value;
          if (j < i) {
            equations.information(column.column, row.column) += value;
          }
        }
      }
    }
  }
}

void LatentPoses::move(const Vector& d, RowMatrix& tangents, RowMatrix& errors) {
  Vector step = Vector::Zero(static_cast<Index>(free_.size()));
  for (Index i = 0; i < step.size(); ++i) {
    for (const Share& share : shares(i)) {
      step[i] += share.factor * d[share.column];
    }
  }
  tangents.resize(observations_.count(), mechanism_.dof());
  errors.resize(observations_.count(), mechanism_.leg_count());
  latent_kernels().move(kernel_rows(nullptr, nullptr), step.data(), tangents.data(), errors.data());
}

LinearPose LatentPoses::rows(Index pose) const {
  const OfPose at(*this, pose);
  const Index bound = mechanism_.leg_count() * mechanism_.closures();
  const Index dof = mechanism_.dof();
  LinearPose linear;
  linear.misfit.resize(plan_.taken[at_index(pose)]);
  linear.variances.resize(linear.misfit.size());
  linear.by_pose.resize(linear.misfit.size(), dof);
  linear.by_unknowns.setZero(linear.misfit.size(), column_count_);
  for (Index i = 0; i < plan_.variances.cols(); ++i) {
    if (!(plan_.variances(pose, i) >= 0)) {
      continue;
    }
    const auto row = static_cast<Index>(linear.origins.size());
    RowOrigin origin = plan_.origins[at_index(i)];
    origin.pose = pose;
    const bool closure = i < bound;
    if (closure) {
      const Index closures = mechanism_.closures();
      origin.by_error =
          is_packed_ ? packed(pose, origin.index, 1 + own_ + dof)
                     : legs_[at_index(origin.index)].by_reading[pose * closures + i % closures];
    }
    linear.origins.push_back(origin);
    linear.misfit[row] = at(places_.misfits, i);
    linear.variances[row] = at(places_.variances, i);
    for (Index k = 0; k < dof; ++k) {
      linear.by_pose(row, k) = at(places_.by_pose, i * dof + k);
    }
    const Index width = closure ? width_ : shared_;
    const Index first = closure ? origin.index * width_ : mechanism_.leg_count() * width_;
    for (Index k = 0; k < width; ++k) {
      const double derivative = closure ? at(places_.by_unknowns, i * width + k)
                                        : at(places_.by_shared, (i - bound) * width + k);
      for (const Share& share : shares(first + k)) {
        linear.by_unknowns(row, share.column) += share.factor * derivative;
      }
    }
  }
  return linear;
}

LinearPose LatentPoses::conditions(Index pose) const {
  LinearPose linear = rows(pose);
  linear.elimination.conditions = by_rows(pose);
  const auto from_rows = linear.elimination.conditions.transpose();
  linear.conditions = from_rows * linear.misfit;
  linear.jacobian = product(from_rows, linear.by_unknowns);
  return linear;
}

RowMatrix LatentPoses::by_rows(Index pose) const {
  const OfPose at(*this, pose);
  const Index r = plan_.variances.cols() - mechanism_.dof();
  RowMatrix g(plan_.taken[at_index(pose)], r);
  Index row = 0;
  for (Index i = 0; i < plan_.variances.cols(); ++i) {
    if (plan_.variances(pose, i) >= 0) {
      for (Index k = 0; k < r; ++k) {
        g(row, k) = at(places_.conditions, i * r + k);
      }
      ++row;
    }
  }
  return g;
}

Vector LatentPoses::values(Index pose) const {
  const OfPose at(*this, pose);
  Vector rho(plan_.variances.cols() - mechanism_.dof());
  for (Index k = 0; k < rho.size(); ++k) {
    rho[k] = at(places_.rho, k);
  }
  return rho;
}

}  // namespace symkin
