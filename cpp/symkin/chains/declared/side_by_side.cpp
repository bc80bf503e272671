// SPDX-License-Identifier: MIT
#include "symkin/chains/declared/side_by_side.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace symkin::declared {
namespace {

using Rows = std::vector<std::size_t>;

Rows not_closed(const std::vector<Closed>& closed) {
  Rows rows;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    if (closed[i] == Closed::no) {
      rows.push_back(i);
    }
  }
  return rows;
}

std::vector<Pose> some_of(const std::vector<Pose>& poses, const Rows& rows) {
  std::vector<Pose> some;
  some.reserve(rows.size());
  for (const std::size_t i : rows) {
    some.push_back(poses[i]);
  }
  return some;
}

// Poses as the kernels take them.
std::vector<double> plain(const std::vector<Pose>& poses) {
  std::vector<double> all(kPoseNumbers * poses.size());
  double* to = all.data();
  for (const Pose& each : poses) {
    to = std::copy_n(each.rotation.data(), 9, to);
    to = std::copy_n(each.position.data(), 3, to);
    *to++ = std::atan2(each.rotation(1, 0), each.rotation(0, 0));
  }
  return all;
}

// A pose that is followed from home, see Assembly::follow().
struct Way {
  std::size_t row;
  double done = 0;
  double step = Assembly::kTriedShares.back();
  double next() const { return std::min(1.0, done + step); }
};

}  // namespace

std::vector<Closed> SideBySide::near(const std::vector<Pose>& poses, const double* starts,
                                     std::vector<double>& joints) const {
  std::vector<Closed> closed(poses.size(), Closed::no);
  joints.resize(static_cast<std::size_t>(leg_.own_count) * poses.size());
  if (!poses.empty()) {
    const auto count = static_cast<Index>(poses.size());
    declared_kernels(count).close(leg_, plain(poses).data(), starts, count, joints.data(),
                                  closed.data());
  }
  return closed;
}

std::vector<Closed> SideBySide::close(const std::vector<Pose>& poses,
                                      std::vector<double>& joints) const {
  std::vector<Closed> closed = near(poses, nullptr, joints);
  follow(poses, closed, joints);
  return closed;
}

void SideBySide::follow(const std::vector<Pose>& poses, std::vector<Closed>& closed,
                        std::vector<double>& joints) const {
  const auto own = static_cast<std::size_t>(leg_.own_count);
  const double shortest = Assembly::kTriedShares.front();
  std::vector<double> there;
  std::vector<Way> ways;
  Rows rows = not_closed(closed);
  for (const double share : Assembly::kTriedShares) {
    std::vector<Pose> on_the_way;
    for (const std::size_t row : rows) {
      on_the_way.push_back(assembly_.on_the_way(poses[row], share));
    }
    const std::vector<Closed> left = near(on_the_way, nullptr, there);
    Rows stay;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (left[k] == Closed::yes) {
        ways.push_back({rows[k]});
      } else if (left[k] == Closed::no) {
        stay.push_back(rows[k]);
      } else {
        closed[rows[k]] = Closed::perhaps;
      }
    }
    rows = std::move(stay);
  }
  for (const Way& way : ways) {
    std::copy_n(leg_.home, own, &joints[way.row * own]);
  }
  while (!ways.empty()) {
    std::vector<Pose> next;
    std::vector<double> starts;
    for (const Way& way : ways) {
      next.push_back(assembly_.on_the_way(poses[way.row], way.next()));
      const auto from = joints.begin() + static_cast<std::ptrdiff_t>(way.row * own);
      starts.insert(starts.end(), from, from + static_cast<std::ptrdiff_t>(own));
    }
    const std::vector<Closed> reached = near(next, starts.data(), there);
    std::vector<Way> left;
    for (std::size_t k = 0; k < ways.size(); ++k) {
      Way way = ways[k];
      const double* const to = &there[k * own];
      double* const at = &joints[way.row * own];
      const auto apart = [&](std::size_t i) { return std::abs(to[i] - at[i]); };
      bool as_before = reached[k] == Closed::yes;
      for (std::size_t i = 0; i < own; ++i) {
        as_before = as_before && apart(i) < Assembly::kFarthest;
      }
      if (as_before) {
        std::copy_n(to, own, at);
        way.done = way.next();
      } else if (reached[k] == Closed::perhaps) {
        closed[way.row] = Closed::perhaps;
        continue;
      } else if ((way.step /= 2) < shortest) {
        continue;
      }
      if (way.done < 1) {
        left.push_back(way);
      } else {
        closed[way.row] = Closed::yes;
      }
    }
    ways = std::move(left);
  }
}

std::vector<Closed> SideBySide::closures(const std::vector<Pose>& poses, const Vector& read,
                                         int first, int count, RowMatrix& rows) const {
  std::vector<Closed> closed = closures_from(nullptr, poses, read, first, count, rows);
  const Rows open = not_closed(closed);
  std::vector<double> around;
  const std::vector<Closed> reached = close(some_of(poses, open), around);
  const auto own = static_cast<std::size_t>(leg_.own_count);
  Rows again;
  std::vector<double> starts;
  for (std::size_t k = 0; k < open.size(); ++k) {
    closed[open[k]] = reached[k] == Closed::perhaps ? Closed::perhaps : Closed::yes;
    if (reached[k] == Closed::yes) {
      again.push_back(open[k]);
      const auto from = around.begin() + static_cast<std::ptrdiff_t>(k * own);
      starts.insert(starts.end(), from, from + static_cast<std::ptrdiff_t>(own));
    }
  }
  if (again.empty()) {
    return closed;
  }
  RowMatrix found(static_cast<Index>(again.size()) * count, rows.cols());
  Vector of_some(static_cast<Index>(again.size()));
  for (std::size_t k = 0; k < again.size(); ++k) {
    of_some[static_cast<Index>(k)] = read[static_cast<Index>(again[k])];
  }
  const std::vector<Closed> came =
      closures_from(starts.data(), some_of(poses, again), of_some, first, count, found);
  for (std::size_t k = 0; k < again.size(); ++k) {
    if (came[k] == Closed::perhaps) {
      closed[again[k]] = Closed::perhaps;
    } else if (came[k] == Closed::yes) {
      rows.middleRows(static_cast<Index>(again[k]) * count, count) =
          found.middleRows(static_cast<Index>(k) * count, count);
    }
  }
  return closed;
}

std::vector<Closed> SideBySide::reach_margins(const std::vector<Pose>& poses,
                                              const std::vector<int>& tangent,
                                              std::vector<double>& margins) const {
  std::vector<double> joints;
  std::vector<Closed> closed = close(poses, joints);
  margins.assign(poses.size(), std::numeric_limits<double>::infinity());
  if (leg_.read < 0) {
    return closed;
  }
  const auto own = static_cast<std::ptrdiff_t>(leg_.own_count);
  std::vector<Pose> all;
  std::vector<double> starts;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (closed[i] != Closed::yes) {
      continue;
    }
    for (const Pose& each : Assembly::around(poses[i], tangent)) {
      all.push_back(each);
      const auto from = joints.begin() + static_cast<std::ptrdiff_t>(i) * own;
      starts.insert(starts.end(), from, from + own);
    }
  }
  if (all.empty()) {
    return closed;
  }
  std::vector<double> slopes(all.size());
  const auto number = static_cast<Index>(all.size());
  declared_kernels(number).slopes(leg_, plain(all).data(), starts.data(), number, slopes.data());
  const std::size_t each = Assembly::around(poses.front(), tangent).size();
  const double* of_pose = slopes.data();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (closed[i] == Closed::yes) {
      const bool at_rest =
          std::none_of(of_pose, of_pose + each, [](double x) { return std::isnan(x); });
      margins[i] = Assembly::margin_of(of_pose, each);
      closed[i] = at_rest ? Closed::yes : Closed::perhaps;
      of_pose += each;
    }
  }
  return closed;
}

std::vector<Closed> SideBySide::closures_from(const double* starts, const std::vector<Pose>& poses,
                                              const Vector& read, int first, int count,
                                              RowMatrix& rows) const {
  std::vector<Closed> closed(poses.size());
  const auto number = static_cast<Index>(poses.size());
  declared_kernels(number).closures(leg_, plain(poses).data(), read.data(), starts, number, first,
                                    count, rows.data(), closed.data());
  return closed;
}

}  // namespace symkin::declared
