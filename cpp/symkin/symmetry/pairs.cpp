// SPDX-License-Identifier: MIT
#include "symkin/symmetry/pairs.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <tuple>

#include "symkin/support/error.hpp"
#include "symkin/symmetry/detail/joint_map.hpp"
#include "symkin/symmetry/detail/leg_ends.hpp"
#include "symkin/symmetry/detail/leg_matching.hpp"

namespace symkin {
namespace {

constexpr double kSame = 1e-3;  // of matrices' entries: far less than between two elements

// Legs that read the same from either end.
bool exchangeable(const Mechanism& mechanism) {
  if (mechanism.pose_space() != PoseSpace::planar && mechanism.pose_space() != PoseSpace::spatial) {
    return false;
  }
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const std::string_view chain = mechanism.model(leg).info().name;
    if (chain != "U[P]S" && chain != "R[P]R" && chain != "R[R]R") {
      return false;
    }
  }
  return true;
}

// Whether the sensor of leg `onto` reads what that of `from` does, but for the joint's sign.
bool sensors_agree(const ChainInfo& chain, const Leg& from, const Leg& onto, const JointMap& map,
                   const SymmetryTolerance& tolerance) {
  const auto value = [&](const Leg& leg, ParameterKind kind) {
    return *find_parameter(chain, {End::none, kind}, leg.parameters.data());
  };
  const double expected = map.sign * value(from, ParameterKind::offset) + map.constant;
  double off = value(onto, ParameterKind::offset) - expected;
  const bool angular = is_angle(chain.active_joint);
  off = angular ? wrap_angle(off) : off;
  const double gains = value(onto, ParameterKind::gain) - value(from, ParameterKind::gain);
  return std::abs(off) <= kImageTolerances * (angular ? tolerance.angle : tolerance.length) &&
         std::abs(gains) <= kImageTolerances * tolerance.gain;
}

// What the pair does to the joints; false where the links of a leg do not agree after all.
bool tell_joints(const Mechanism& mechanism, const SymmetryTolerance& tolerance, FoundPair& found) {
  found.keeps_modes = true;
  found.permutes_readings = true;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    const Leg& from = mechanism.leg(leg);
    const Leg& onto = mechanism.leg(found.permutation[static_cast<std::size_t>(leg)]);
    const ChainInfo& chain = mechanism.model(leg).info();
    std::optional<JointMap> map;
    if (found.pair.exchange) {
      // A distance stays; an elbow is turned the other way where the leg begins at its end.
      const bool elbow = chain.active_joint == ActiveJoint::elbow_angle;
      const int sign = elbow && !found.pair.improper() ? -1 : 1;
      map = JointMap{sign, sign, 0};
    } else {
      map = joint_map(chain, from, onto, found.pair, tolerance);
    }
    if (!map.has_value()) {
      return false;
    }
    found.keeps_modes &= arrives_in_mode(chain, from, onto, *map);
    found.permutes_readings &= sensors_agree(chain, from, onto, *map, tolerance);
    found.joints.push_back(*map);
  }
  return true;
}

// Where the product of two is among them; its number, or -1.
class ProductTable {
 public:
  ProductTable(const std::vector<FoundPair>& pairs, double size) : count_(pairs.size()) {
    for (const FoundPair& outer : pairs) {
      for (const FoundPair& inner : pairs) {
        const SymmetryPair product = compose(outer.pair, inner.pair);
        const auto same = std::find_if(pairs.begin(), pairs.end(), [&](const FoundPair& other) {
          return apart(other.pair, product, size) < kSame + 1e-9;
        });
        table_.push_back(same == pairs.end() ? -1 : static_cast<Index>(same - pairs.begin()));
      }
    }
  }

  Index product(std::size_t outer, std::size_t inner) const {
    return table_[outer * count_ + inner];
  }

 private:
  std::size_t count_;
  std::vector<Index> table_;
};

// The largest group that grows from the identity, the least deviating elements first.
std::vector<FoundPair> closed(std::vector<FoundPair> pairs, double size) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const FoundPair& a, const FoundPair& b) {
    return a.in_tolerances < b.in_tolerances;
  });
  const ProductTable table(pairs, size);
  std::vector<std::size_t> group;
  std::vector<bool> inside(pairs.size(), false);
  const auto grown = [&](std::size_t next) {
    std::vector<std::size_t> members = group;
    std::vector<bool> within = inside;
    const auto add = [&](std::size_t member) {
      if (!within[member]) {
        within[member] = true;
        members.push_back(member);
      }
    };
    add(next);
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t k = 0; k <= i; ++k) {
        for (const auto& [a, b] : {std::pair(members[i], members[k]), {members[k], members[i]}}) {
          const Index product = table.product(a, b);
          if (product < 0) {
            return;
          }
          add(static_cast<std::size_t>(product));
        }
      }
    }
    group = std::move(members);
    inside = std::move(within);
  };
  for (std::size_t next = 0; next < pairs.size(); ++next) {
    if (!inside[next]) {
      grown(next);
    }
  }
  std::vector<FoundPair> result;
  result.reserve(group.size());
  for (const std::size_t member : group) {
    result.push_back(pairs[member]);
  }
  return result;
}

// By how far the base turns, then the platform: the identity comes first.
std::tuple<bool, bool, int, int> place(const FoundPair& found) {
  const auto turn = [](const Isometry& motion, bool improper) {
    return static_cast<int>(std::lround(1e4 * (3 - (improper ? -1 : 1) * motion.linear.trace())));
  };
  const bool improper = found.pair.improper();
  return {found.pair.exchange, improper, turn(found.pair.base, improper),
          turn(found.pair.platform, improper)};
}

}  // namespace

PairSymmetry find_pairs(const Mechanism& mechanism, ConstVector home,
                        const SymmetryTolerance& tolerance) {
  tolerance.check();
  check_poses(mechanism, home.transpose());
  PairSymmetry result;
  double size = 1;
  for (const bool exchange : {false, true}) {
    if (exchange && !exchangeable(mechanism)) {
      continue;
    }
    const Matching matching = matching_of(mechanism, home, tolerance, exchange);
    size = std::max(matching.onto[0].size, matching.onto[1].size);
    result.continuous_base = matching.onto[0].rank < 2;
    result.continuous_platform = matching.turns && matching.onto[1].rank < 2;
    for (FoundPair& found : matched(matching)) {
      if (tell_joints(mechanism, tolerance, found)) {
        result.pairs.push_back(std::move(found));
      }
    }
  }
  result.pairs = closed(std::move(result.pairs), size);
  std::stable_sort(result.pairs.begin(), result.pairs.end(),
                   [](const FoundPair& a, const FoundPair& b) { return place(a) < place(b); });
  return result;
}

}  // namespace symkin
