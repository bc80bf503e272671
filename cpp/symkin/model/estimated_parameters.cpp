// SPDX-License-Identifier: MIT
#include "symkin/model/estimated_parameters.hpp"

#include <cmath>

namespace symkin {
namespace {

// The coordinate of the base point along which a guide through it runs most.
ParameterKind along_guide(const ChainInfo& chain, ConstVector parameters) {
  constexpr double kTie = 1 + 1e-6;
  const auto value = [&](ParameterKind kind) {
    return parameters[static_cast<Index>(chain.find({End::base, kind}))];
  };
  const double elevation = value(ParameterKind::guide_elevation);
  const double swing = value(ParameterKind::swing);
  const double turn = value(ParameterKind::reference_azimuth) - value(ParameterKind::azimuth);
  const double outward = std::cos(swing) * std::cos(elevation);
  const double radial = std::abs(outward * std::cos(turn) - std::sin(swing) * std::sin(turn));
  const double tangential = std::abs(outward * std::sin(turn) + std::sin(swing) * std::cos(turn));
  const double vertical = std::abs(std::cos(swing) * std::sin(elevation));
  if (vertical * kTie >= radial && vertical * kTie >= tangential) {
    return ParameterKind::height;
  }
  return radial * kTie >= tangential ? ParameterKind::radius : ParameterKind::azimuth;
}

}  // namespace

std::vector<Index> estimated_parameters(const ChainInfo& chain, ConstVector parameters) {
  std::size_t redundant = chain.parameters.size();
  if (chain.active_joint == ActiveJoint::travel_from_point) {
    redundant = chain.find({End::base, along_guide(chain, parameters)});
  }
  std::vector<Index> estimated;
  for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
    const ParameterKind kind = chain.parameters[i].role.kind;
    if (i != redundant && !is_constant(kind) && !is_given(kind)) {
      estimated.push_back(static_cast<Index>(i));
    }
  }
  return estimated;
}

}  // namespace symkin
