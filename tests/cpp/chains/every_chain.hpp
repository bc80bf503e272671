// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "symkin/chains/registry.hpp"
#include "symkin/model/leg_model.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/support/random.hpp"

// What the suites over all planar chains share: the chains, random legs and their states. Some take
// those in space too.
namespace symkin::testing {

struct Chain {
  std::string name;
  Platform platform;
};

inline std::ostream& operator<<(std::ostream& stream, const Chain& chain) {
  const char* const platforms[] = {"", ", point platform", ", translating platform",
                                   ", spherical platform"};
  return stream << chain.name << platforms[static_cast<int>(chain.platform)];
}

inline const ChainInfo& info_of(const Chain& chain) {
  return leg_model(chain.name, chain.platform).info();
}

inline std::vector<Chain> registered_chains() {
  std::vector<Chain> chains;
  for (const Platform platform :
       {Platform::rigid, Platform::point, Platform::translating, Platform::spherical}) {
    for (const std::string& name : chain_names(platform)) {
      chains.push_back({name, platform});
    }
  }
  return chains;
}

inline std::vector<Chain> chains_of_size(Index position) {
  std::vector<Chain> chains;
  for (const Chain& chain : registered_chains()) {
    if (position_size(info_of(chain).pose_space) == position) {
      chains.push_back(chain);
    }
  }
  return chains;
}

inline std::vector<Chain> every_chain() { return chains_of_size(2); }
inline std::vector<Chain> every_spatial_chain() {
  std::vector<Chain> chains = chains_of_size(3);
  const std::vector<Chain> on_sphere = chains_of_size(0);
  chains.insert(chains.end(), on_sphere.begin(), on_sphere.end());
  return chains;
}

template <typename Predicate>
std::vector<Chain> chains_where(const Predicate& wanted) {
  std::vector<Chain> chains;
  for (const Chain& chain : every_chain()) {
    if (wanted(chain)) {
      chains.push_back(chain);
    }
  }
  return chains;
}

// Filters. Only where a leg can stand in two ways has it an orientation, and an end to its reach.
inline bool has_two_roots(const Chain& chain) { return info_of(chain).mode_is_orientation; }
inline bool has_one_root(const Chain& chain) { return !has_two_roots(chain); }
inline bool is_rigid(const Chain& chain) { return chain.platform == Platform::rigid; }

// "RRR_active1_rigid": what GoogleTest accepts as a name.
inline std::string test_name(const ::testing::TestParamInfo<Chain>& info) {
  const std::string& chain = info.param.name;
  std::string letters;
  for (const char c : chain) {
    letters += c == '[' || c == ']' || c == ' ' ? "" : std::string(1, c);
  }
  return letters + "_active" + std::to_string(chain.find('[') + 1) +
         std::array{"_rigid", "_point", "_translating",
                    "_spherical"}[static_cast<std::size_t>(info.param.platform)];
}

// One leg at one pose with one reading.
struct State {
  Vector parameters;
  RowMatrix pose;  // one row
  int mode;
  double reading;
};

// The platform moved at its orientation.
inline State translated(State state, double distance, double azimuth) {
  state.pose(0, 0) += distance * std::cos(azimuth);
  state.pose(0, 1) += distance * std::sin(azimuth);
  return state;
}

class EveryChain : public ::testing::TestWithParam<Chain> {
 protected:
  static constexpr int kStates = 200;

  const ChainModel& model() const { return leg_model(GetParam().name, GetParam().platform); }
  const ChainInfo& info() const { return info_of(GetParam()); }
  std::vector<int> modes() const {
    return has_two_roots(GetParam()) ? std::vector<int>{-1, 1} : std::vector<int>{1};
  }

  double reading(const State& state, int mode) const {
    Vector readings(1);
    model().inverse_kinematics(state.parameters, mode, state.pose, readings);
    return readings[0];
  }
  double margin(const State& state) const {
    Vector margins(1);
    model().reach_margin(state.parameters, state.pose, margins);
    return margins[0];
  }
  Vector closures(const State& state) const {
    Vector values(info().closures);
    model().closure(state.parameters, state.pose, Vector::Constant(1, state.reading), values);
    return values;
  }
  // The first, which shows the reading.
  double closure(const State& state) const { return closures(state)[0]; }
  ClosureRows linearise(const State& state) const {
    ClosureRows rows;
    model().linearise(state.parameters, state.pose, Vector::Constant(1, state.reading), rows);
    return rows;
  }
  RowMatrix joint_centres(const State& state) const {
    return model().joint_centres(state.parameters, state.pose.row(0).transpose(), state.reading);
  }

  std::optional<Index> find_parameter(std::string_view name) const {
    for (std::size_t i = 0; i < info().parameters.size(); ++i) {
      if (info().parameters[i].name == name) {
        return static_cast<Index>(i);
      }
    }
    return std::nullopt;
  }
  // Zero where the chain does without it.
  double parameter(const State& state, std::string_view name) const {
    const auto index = find_parameter(name);
    return index ? state.parameters[*index] : 0;
  }
  double gain(const State& state) const { return parameter(state, "sensor_gain"); }
  double active_joint(const State& state) const {
    return gain(state) * state.reading + parameter(state, "sensor_offset");
  }
  bool has(End end, ParameterKind kind) const {
    return info().find({end, kind}) < info().parameters.size();
  }

  // Links of 1 to 2.6 m (or rad) that are never equal, guides off their joints: no special
  // geometry.
  Vector random_parameters(Random& random) const {
    const auto between = [&](double a, double b) { return a + (b - a) * random.uniform(); };
    const auto either_sign = [&](double value) { return random.uniform() < 0.5 ? -value : value; };
    Vector parameters(model().parameter_count());
    for (Index i = 0; i < parameters.size(); ++i) {
      const auto& [name, role, held] = info().parameters[static_cast<std::size_t>(i)];
      if (name == "proximal_length" || name == "proximal_arc") {
        parameters[i] = between(1.0, 1.6);
      } else if (name == "distal_length" || name == "distal_arc") {
        parameters[i] = between(1.8, 2.6);
      } else if (name == "guide_offset") {
        parameters[i] = either_sign(between(0.2, 0.6));
      } else if (role.kind == ParameterKind::pulley_radius) {
        parameters[i] = between(0.5, 0.9);
      } else if (role.kind == ParameterKind::radius ||
                 role.kind == ParameterKind::direction_distance) {
        parameters[i] = between(0.3, 1.5);
      } else if (role.kind == ParameterKind::height) {
        parameters[i] = between(-0.5, 0.5);
      } else if (role.kind == ParameterKind::gain) {
        parameters[i] = either_sign(between(0.6, 1.6));
      } else {
        parameters[i] = between(-3, 3);
      }
    }
    return parameters;
  }

  // The position within +- extent, any orientation.
  RowMatrix random_pose(Random& random, double extent) const {
    RowMatrix pose(1, coordinate_count(info().pose_space));
    for (Index i = 0; i < pose.cols(); ++i) {
      pose(0, i) =
          (2 * random.uniform() - 1) * (i < position_size(info().pose_space) ? extent : 3.0);
    }
    return pose;
  }

  // A pose within reach and away from serial singularities, in a random mode.
  std::optional<State> closed_state(const Vector& parameters, Random& random) const {
    State state{parameters, random_pose(random, 2), random.uniform() < 0.5 ? -1 : 1, 0};
    state.reading = reading(state, state.mode);
    if (margin(state) < 0.05 || std::abs(linearise(state).by_reading[0] / gain(state)) < 0.1) {
      return std::nullopt;
    }
    return state;
  }

  std::vector<State> random_states(int count = kStates, std::uint64_t seed = 1) const {
    Random random(seed);
    std::vector<State> states;
    while (static_cast<int>(states.size()) < count) {
      if (const auto state = closed_state(random_parameters(random), random)) {
        states.push_back(*state);
      }
    }
    return states;
  }
};

}  // namespace symkin::testing
