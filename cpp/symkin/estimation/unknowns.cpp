// SPDX-License-Identifier: MIT
#include "symkin/estimation/unknowns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "symkin/model/sensor.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/error.hpp"

namespace symkin {
namespace {

bool has_straight_sensor(const ChainInfo& chain) {
  return std::count_if(chain.parameters.begin(), chain.parameters.end(), [](const auto& parameter) {
           return is_sensor(parameter.role.kind);
         }) == LinearSensor::kParameters;
}

Vector along(const Setup& setup, Index leg, const RowMatrix& covariates, LegCovariate::Of of) {
  Vector sum = Vector::Zero(covariates.rows());
  for (Index k = 0; covariates.cols() > 0 && k < setup.leg_slopes.cols(); ++k) {
    if (setup.leg_covariates[static_cast<std::size_t>(k)].of == of) {
      sum += setup.leg_slopes(leg, k) * covariates.col(k * setup.leg_slopes.rows() + leg);
    }
  }
  return sum;
}

constexpr const char* kAxes[] = {"x", "y", "z", "rx", "ry", "rz"};
constexpr const char* kBed[] = {"c0", "c1", "c2", "bow"};

// What `visit` does with every scalar that the mechanism has, and what makes its name.
template <typename Visit>
void visit_unknowns(const Mechanism& mechanism, const Setup& setup, const Visit& visit) {
  const UnknownList list(setup);
  const PoseSpace space = mechanism.pose_space();
  const bool planar = position_size(space) == 2;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const auto of_leg = [&](Index scalar, std::string_view name) {
      visit(scalar, [&] { return "leg" + std::to_string(leg + 1) + "." + std::string(name); });
    };
    Index scalar = list.leg(leg);
    for (const ParameterInfo& parameter : mechanism.model(leg).info().parameters) {
      if (parameter.role.kind != ParameterKind::absent) {
        of_leg(scalar, parameter.name);
      }
      ++scalar;
    }
    for (const ParameterInfo& term : CurvedSensor::kCurvatureInfos) {
      of_leg(scalar++, term.name);
    }
    for (std::size_t k = 0; k < setup.leg_covariates.size(); ++k) {
      of_leg(list.leg_slope(leg) + static_cast<Index>(k), setup.leg_covariates[k].name);
    }
  }
  for (const Index slot : frame_slots(space)) {
    const std::string axis = planar && slot == 5 ? "phi" : kAxes[slot];
    visit(list.base() + slot, [&] { return "base." + axis; });
    visit(list.target() + slot, [&] { return "target." + axis; });
    for (std::size_t i = 0; i < setup.base_covariates.size(); ++i) {
      visit(list.base_slope(static_cast<Index>(i)) + slot,
            [&] { return setup.base_covariates[i] + "." + axis; });
    }
  }
  for (Index axis = 0; axis < position_size(space); ++axis) {
    for (Index i = 0; i < setup.points.rows(); ++i) {
      visit(list.point(i) + axis,
            [&] { return "point" + std::to_string(i + 1) + "." + kAxes[axis]; });
    }
    for (Index i = 0; i < setup.anchors.rows(); ++i) {
      visit(list.anchor(i) + axis,
            [&] { return "anchor" + std::to_string(i + 1) + "." + kAxes[axis]; });
    }
  }
  for (Index i = 0; position_size(space) > 0 && i < setup.zeros.size(); ++i) {
    visit(list.zero(i), [&] { return "distance" + std::to_string(i + 1) + ".zero"; });
  }
  for (Index i = 0; position_size(space) == 3 && i < 4; ++i) {
    visit(list.plane() + i, [&] { return std::string("plane.") + kBed[i]; });
  }
}

}  // namespace

Setup Setup::of(const Mechanism& mechanism) {
  Setup setup;
  setup.parameters = mechanism.parameters();
  setup.curvature = RowMatrix::Zero(mechanism.leg_count(), UnknownList::kCurvature);
  setup.points.resize(0, 3);
  setup.anchors.resize(0, 3);
  setup.zeros.resize(0);
  setup.leg_slopes.resize(mechanism.leg_count(), 0);
  setup.base_slopes.resize(0, 6);
  return setup;
}

CurvedSensor Setup::sensor(Index leg) const {
  const Index gain = parameters.cols() - LinearSensor::kParameters;
  return {LinearSensor(&parameters(leg, gain)), curvature(leg, 0), curvature(leg, 1),
          curvature(leg, 2)};
}

double Setup::model_reading(Index leg, double reading) const {
  if (curvature.row(leg).isZero(0)) {
    return reading;
  }
  const CurvedSensor curved = sensor(leg);
  return (curved.active_joint(reading) - curved.straight.offset) / curved.straight.gain;
}

Vector Setup::reading_shifts(Index leg, const RowMatrix& covariates) const {
  return along(*this, leg, covariates, LegCovariate::Of::reading);
}

Vector Setup::growths(Index leg, const RowMatrix& covariates) const {
  return along(*this, leg, covariates, LegCovariate::Of::lengths);
}

Frame Setup::base_at(const Eigen::Ref<const Eigen::RowVectorXd>& covariates) const {
  return moved(base, (covariates * base_slopes).transpose());
}

UnknownList::UnknownList(const Setup& setup)
    : legs_(setup.parameters.rows()),
      parameters_(setup.parameters.cols()),
      leg_slopes_(setup.leg_slopes.cols()),
      points_(setup.points.rows()),
      anchors_(setup.anchors.rows()),
      zeros_(setup.zeros.size()),
      base_slopes_(setup.base_slopes.rows()) {}

std::vector<std::string> unknown_names(const Mechanism& mechanism, const Setup& setup) {
  std::vector<std::string> names(static_cast<std::size_t>(UnknownList(setup).size()));
  visit_unknowns(mechanism, setup, [&](Index scalar, const auto& name) {
    names[static_cast<std::size_t>(scalar)] = name();
  });
  return names;
}

bool is_length(const ChainInfo& chain, const ParameterInfo& parameter) {
  const ParameterKind kind = parameter.role.kind;
  return !chain.is_angular(parameter) && kind != ParameterKind::gain && !is_constant(kind) &&
         kind != ParameterKind::absent;
}

bool grows(const ChainInfo& chain, const ParameterInfo& parameter) {
  const bool of_length =
      parameter.role.kind == ParameterKind::gain && !is_angle(chain.active_joint);
  return of_length || is_length(chain, parameter);
}

std::vector<std::vector<Index>> growing_parameters(const Mechanism& mechanism) {
  std::vector<std::vector<Index>> all;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const ChainInfo& chain = mechanism.model(leg).info();
    std::vector<Index>& growing = all.emplace_back();
    for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
      if (grows(chain, chain.parameters[i])) {
        growing.push_back(static_cast<Index>(i));
      }
    }
  }
  return all;
}

double longest_length(const Mechanism& mechanism, const Setup& setup) {
  double longest = 0;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const ChainInfo& chain = mechanism.model(leg).info();
    for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
      const ParameterInfo& parameter = chain.parameters[i];
      const double value = std::abs(setup.parameters(leg, static_cast<Index>(i)));
      if (is_length(chain, parameter) && std::isfinite(value)) {
        longest = std::max(longest, value);
      }
    }
  }
  return longest > 0 ? longest : 1;
}

Vector natural_sizes(const Mechanism& mechanism, const Setup& setup) {
  const UnknownList list(setup);
  const double length = longest_length(mechanism, setup);
  Vector sizes = Vector::Constant(list.size(), length);
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const ChainInfo& chain = mechanism.model(leg).info();
    double gain = 1;
    for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
      const ParameterInfo& parameter = chain.parameters[i];
      const Index scalar = list.leg(leg) + static_cast<Index>(i);
      if (parameter.role.kind == ParameterKind::gain) {
        gain = std::abs(setup.parameters(leg, static_cast<Index>(i)));
        sizes[scalar] = gain > 0 ? gain : 1;
      } else if (chain.is_angular(parameter)) {
        sizes[scalar] = 1;
      }
    }
    const double joint = is_angle(chain.active_joint) ? 1 : length;
    sizes.segment(list.curvature(leg), UnknownList::kCurvature) << gain * gain / joint, joint,
        joint;
    for (std::size_t k = 0; k < setup.leg_covariates.size(); ++k) {
      const bool reads = setup.leg_covariates[k].of == LegCovariate::Of::reading;
      sizes[list.leg_slope(leg) + static_cast<Index>(k)] = reads && gain > 0 ? joint / gain : 1;
    }
  }
  for (const Index frame : {list.base(), list.target()}) {
    sizes.segment(frame + 3, 3).setOnes();
  }
  sizes.segment(list.plane() + 1, 2).setOnes();
  for (Index i = 0; i < setup.base_slopes.rows(); ++i) {
    sizes.segment(list.base_slope(i) + 3, 3).setOnes();
  }
  return sizes;
}

Layout Layout::of_all_parameters(const Mechanism& mechanism, const Setup& setup) {
  const UnknownList list(setup);
  Layout layout;
  layout.column.assign(static_cast<std::size_t>(list.size()), -1);
  Index columns = 0;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    for (const Index i : mechanism.estimated_parameters(leg)) {
      layout.column[static_cast<std::size_t>(list.leg(leg) + i)] = columns++;
    }
  }
  layout.prior = Vector::Constant(columns, std::numeric_limits<double>::infinity());
  return layout;
}

bool Layout::is_free(Index scalar) const {
  return column[static_cast<std::size_t>(scalar)] >= 0 ||
         std::any_of(ties.begin(), ties.end(),
                     [scalar](const Tie& tie) { return tie.scalar == scalar; });
}

RowMatrix Layout::prior_rows() const {
  const Index own = prior.array().isFinite().count();
  RowMatrix rows = RowMatrix::Zero(own + relations.rows(), columns());
  for (Index i = 0, row = 0; i < columns(); ++i) {
    if (std::isfinite(prior[i])) {
      rows(row++, i) = 1 / prior[i];
    }
  }
  if (relations.rows() > 0) {
    rows.bottomRows(relations.rows()) = relations;
  }
  return rows;
}

RowMatrix Layout::prior_information() const {
  RowMatrix square = prior.cwiseAbs2().cwiseInverse().asDiagonal();
  if (relations.rows() > 0) {
    square += product(relations.transpose(), relations);
  }
  return square;
}

void Layout::check(const Mechanism& mechanism, const Setup& setup) const {
  std::vector<bool> exists(static_cast<std::size_t>(UnknownList(setup).size()), false);
  visit_unknowns(mechanism, setup, [&](Index scalar, const auto&) {
    exists[static_cast<std::size_t>(scalar)] = true;
  });
  if (column.size() != exists.size()) {
    throw InvalidInput("the layout has " + std::to_string(column.size()) + " scalars; expected " +
                       std::to_string(exists.size()));
  }
  std::vector<bool> used(static_cast<std::size_t>(columns()), false);
  for (std::size_t i = 0; i < exists.size(); ++i) {
    if (column[i] < -1 || column[i] >= columns()) {
      throw InvalidInput("scalar " + std::to_string(i) + " moves with column " +
                         std::to_string(column[i]) + "; expected -1 to " +
                         std::to_string(columns() - 1));
    }
    if (column[i] >= 0 && !exists[i]) {
      throw InvalidInput("scalar " + std::to_string(i) + " does not exist in a " +
                         std::string(to_string(mechanism.pose_space())) + " mechanism");
    }
    if (column[i] >= 0) {
      used[static_cast<std::size_t>(column[i])] = true;
    }
  }
  if (std::find(used.begin(), used.end(), false) != used.end()) {
    throw InvalidInput("a column of the layout moves no scalar");
  }
  for (const Tie& tie : ties) {
    const auto scalar = static_cast<std::size_t>(tie.scalar);
    if (scalar >= exists.size() || !exists[scalar] || column[scalar] >= 0 || tie.column < 0 ||
        tie.column >= columns() || !std::isfinite(tie.factor)) {
      throw InvalidInput("a tie of scalar " + std::to_string(tie.scalar) + " to column " +
                         std::to_string(tie.column) + " by " + std::to_string(tie.factor) +
                         "; expected a scalar without a column of its own, a column and a number");
    }
  }
  const UnknownList list(setup);
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    bool curved = !setup.curvature.row(leg).isZero(0);
    for (Index i = 0; i < UnknownList::kCurvature; ++i) {
      curved = curved || is_free(list.curvature(leg) + i);
    }
    if (curved && !has_straight_sensor(mechanism.model(leg).info())) {
      throw InvalidInput("the sensor of leg " + std::to_string(leg + 1) +
                         " has a law of its own; curvature belongs to a straight one");
    }
  }
  if (!(prior.array() > 0).all()) {
    throw InvalidInput("a prior's standard deviation is not positive");
  }
  if ((relations.rows() > 0 && relations.cols() != columns()) || !relations.allFinite()) {
    throw InvalidInput("priors of several columns are " + std::to_string(relations.rows()) + " x " +
                       std::to_string(relations.cols()) + "; expected finite rows of " +
                       std::to_string(columns()));
  }
}

Setup moved(Setup setup, const Layout& layout, ConstVector change) {
  const UnknownList list(setup);
  Vector steps(list.size());
  for (Index i = 0; i < list.size(); ++i) {
    const Index column = layout.column[static_cast<std::size_t>(i)];
    steps[i] = column < 0 ? 0 : change[column];
  }
  for (const Tie& tie : layout.ties) {
    steps[tie.scalar] += tie.factor * change[tie.column];
  }
  const Index p = setup.parameters.cols();
  for (Index leg = 0; leg < setup.parameters.rows(); ++leg) {
    setup.parameters.row(leg) += steps.segment(list.leg(leg), p);
    setup.curvature.row(leg) += steps.segment(list.curvature(leg), UnknownList::kCurvature);
    setup.leg_slopes.row(leg) += steps.segment(list.leg_slope(leg), setup.leg_slopes.cols());
  }
  setup.base = moved(setup.base, steps.segment<6>(list.base()));
  setup.target = moved(setup.target, steps.segment<6>(list.target()));
  for (Index i = 0; i < setup.points.rows(); ++i) {
    setup.points.row(i) += steps.segment<3>(list.point(i));
  }
  for (Index i = 0; i < setup.anchors.rows(); ++i) {
    setup.anchors.row(i) += steps.segment<3>(list.anchor(i));
  }
  setup.plane += steps.segment<4>(list.plane());
  setup.zeros += steps.segment(list.zero(0), setup.zeros.size());
  for (Index i = 0; i < setup.base_slopes.rows(); ++i) {
    setup.base_slopes.row(i) += steps.segment<6>(list.base_slope(i));
  }
  return setup;
}

}  // namespace symkin
