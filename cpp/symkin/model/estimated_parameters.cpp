// SPDX-License-Identifier: MIT
#include "symkin/model/estimated_parameters.hpp"

#include <algorithm>
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
  const double swing = value(ParameterKind::guide_swing);
  const double turn = value(ParameterKind::guide_azimuth) - value(ParameterKind::azimuth);
  const double outward = std::cos(swing) * std::cos(elevation);
  const double radial = std::abs(outward * std::cos(turn) - std::sin(swing) * std::sin(turn));
  const double tangential = std::abs(outward * std::sin(turn) + std::sin(swing) * std::cos(turn));
  const double vertical = std::abs(std::cos(swing) * std::sin(elevation));
  if (vertical * kTie >= radial && vertical * kTie >= tangential) {
    return ParameterKind::height;
  }
  return radial * kTie >= tangential ? ParameterKind::radius : ParameterKind::azimuth;
}

// Whether driven legs that swing in planes stand upright, between circles of equal radii.
bool stand_upright(const ChainInfo& chain, ConstRows parameters) {
  constexpr double kEqual = 0.1;  // of the larger circle
  if (chain.active_joint != ActiveJoint::distance || chain.closures == 1) {
    return false;
  }
  const auto mean = [&](End end) {
    const auto column = static_cast<Index>(chain.find({end, ParameterKind::radius}));
    return column < parameters.cols() ? parameters.col(column).cwiseAbs().mean() : 0.0;
  };
  const double base = mean(End::base);
  const double platform = mean(End::platform);
  return std::abs(base - platform) <= kEqual * std::max(base, platform);
}

}  // namespace

std::vector<std::vector<Index>> estimated_parameters(const ChainInfo& chain, ConstRows parameters) {
  const std::size_t none = chain.parameters.size();
  const std::size_t height =
      stand_upright(chain, parameters) ? chain.find({End::base, ParameterKind::height}) : none;
  std::vector<std::vector<Index>> all;
  for (Index leg = 0; leg < parameters.rows(); ++leg) {
    const std::size_t redundant =
        chain.active_joint == ActiveJoint::travel_from_point
            ? chain.find({End::base, along_guide(chain, parameters.row(leg).transpose())})
            : height;
    std::vector<Index>& estimated = all.emplace_back();
    for (std::size_t i = 0; i < chain.parameters.size(); ++i) {
      const ParameterKind kind = chain.parameters[i].role.kind;
      if (i != redundant && !chain.parameters[i].held && !is_constant(kind) && !is_given(kind)) {
        estimated.push_back(static_cast<Index>(i));
      }
    }
  }
  return all;
}

}  // namespace symkin
