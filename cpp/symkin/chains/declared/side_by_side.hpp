// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "symkin/chains/declared/assembly.hpp"
#include "symkin/chains/declared/lane_leg.hpp"
#include "symkin/support/types.hpp"

namespace symkin::declared {

// A leg at several poses at once, by the kernels if they take it.
class SideBySide {
 public:
  explicit SideBySide(const Assembly& assembly)
      : assembly_(assembly), possible_(assembly.lane_leg(transforms_, leg_)) {}
  bool possible() const { return possible_; }

  // As Assembly::close(), joints a row a pose; `perhaps` wants a closer look.
  std::vector<Closed> close(const std::vector<Pose>& poses, std::vector<double>& joints) const;

  // As Assembly::close_around_readings(), so many closures from the first on, a row each, as the
  // kernels write them. Where the leg cannot be closed at any readings, or not from there, what it
  // came to from home is all there is: `yes`; `perhaps` wants a closer look.
  std::vector<Closed> closures(const std::vector<Pose>& poses, const Vector& read, int first,
                               int count, RowMatrix& rows) const;

  // As Assembly::reach_margin() where the leg closes, which is `yes`.
  std::vector<Closed> reach_margins(const std::vector<Pose>& poses, const std::vector<int>& tangent,
                                    std::vector<double>& margins) const;

 private:
  std::vector<Closed> near(const std::vector<Pose>& poses, const double* starts,
                           std::vector<double>& joints) const;
  std::vector<Closed> closures_from(const double* starts, const std::vector<Pose>& poses,
                                    const Vector& read, int first, int count,
                                    RowMatrix& rows) const;
  void follow(const std::vector<Pose>& poses, std::vector<Closed>& closed,
              std::vector<double>& joints) const;

  const Assembly& assembly_;
  std::vector<LaneTransform> transforms_;
  LaneLeg leg_{};
  bool possible_;
};

}  // namespace symkin::declared
