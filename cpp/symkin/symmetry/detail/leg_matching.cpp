// SPDX-License-Identifier: MIT
#include "symkin/symmetry/detail/leg_matching.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "symkin/model/pose.hpp"
#include "symkin/symmetry/detail/joint_map.hpp"

namespace symkin {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Of what is compared before the motion is known, in tolerances: generous, since what it lets
// through is compared again.
constexpr double kGenerous = 16 * kImageTolerances;
constexpr int kRefits = 2;

Vector3d foot(const LineFeature& line, const Vector3d& from) {
  const Vector3d offset = line.through - from;
  return offset - offset.dot(line.direction) * line.direction;
}

Matrix3d across(const Vector3d& direction) {
  return Matrix3d::Identity() - direction * direction.transpose();
}

// A leg's vectors as seen from the centre, places in units of the size; undirected ones last.
struct LegVectors {
  std::vector<Vector3d> vectors;
  std::size_t directed = 0;  // how many of them have a sense
};

LegVectors vectors_of(const EndFeatures& end, const Vector3d& centre, double size) {
  LegVectors result;
  if (end.point.has_value()) {
    result.vectors.emplace_back((*end.point - centre) / size);
  }
  for (const LineFeature& line : end.lines) {
    if (line.placed) {
      result.vectors.emplace_back(foot(line, centre) / size);
    }
  }
  result.vectors.insert(result.vectors.end(), end.directed.begin(), end.directed.end());
  result.directed = result.vectors.size();
  for (const LineFeature& line : end.lines) {
    result.vectors.push_back(line.direction);
  }
  return result;
}

// The mean of the points; without any the point nearest to the lines. Where nothing has a place,
// guides are where their sensors' offsets put them.
Vector3d centre_of(const std::vector<EndFeatures>& legs, bool planar) {
  Vector3d sum = Vector3d::Zero();
  double points = 0;
  std::vector<Place> lines;
  std::vector<Place> hints;
  for (const EndFeatures& end : legs) {
    if (end.point.has_value()) {
      sum += *end.point;
      ++points;
    }
    for (const LineFeature& line : end.lines) {
      if (line.placed) {
        lines.push_back({line.through, across(line.direction)});
      } else if (planar) {
        hints.push_back({line.through, line.direction * line.direction.transpose()});
      }
    }
  }
  if (points > 0) {
    return sum / points;
  }
  return nearest_point(lines.empty() ? hints : lines, Vector3d::Zero());
}

Side side_of(std::vector<EndFeatures> legs, bool planar, double unit, double threshold) {
  Side side;
  side.centre = centre_of(legs, planar);
  side.unit = unit;
  double farthest = 0;
  for (const EndFeatures& end : legs) {
    farthest = std::max(farthest, end.point.has_value() ? (*end.point - side.centre).norm() : 0);
    for (const LineFeature& line : end.lines) {
      farthest = std::max(farthest, line.placed ? foot(line, side.centre).norm() : 0);
    }
  }
  side.size = farthest > 4 * unit ? farthest : 1;
  std::vector<Vector3d> all;
  for (const EndFeatures& end : legs) {
    for (const Vector3d& vector : vectors_of(end, side.centre, side.size).vectors) {
      all.push_back(vector);
    }
  }
  side.rank = rank_of(all, threshold);
  side.legs = std::move(legs);
  return side;
}

LegVectors vectors_of(const Side& side, Index leg) {
  return vectors_of(side.legs[static_cast<std::size_t>(leg)], side.centre, side.size);
}

// The fewest legs, greedily, whose features span what those of all do.
std::vector<Index> frame_legs(const Matching& matching) {
  const Index count = matching.mechanism->leg_count();
  std::vector<Index> chosen;
  std::array<std::vector<Vector3d>, 2> spanned;
  const auto ranks = [&](const std::array<std::vector<Vector3d>, 2>& vectors) {
    return rank_of(vectors[0], matching.threshold) + rank_of(vectors[1], matching.threshold);
  };
  while (static_cast<Index>(chosen.size()) < count &&
         ranks(spanned) < matching.from[0].rank + matching.from[1].rank) {
    Index best = -1;
    double most = -1;
    for (Index leg = 0; leg < count; ++leg) {
      if (std::find(chosen.begin(), chosen.end(), leg) != chosen.end()) {
        continue;
      }
      auto with = spanned;
      double gained = 0;
      for (std::size_t end = 0; end < 2; ++end) {
        for (const Vector3d& vector : vectors_of(matching.from[end], leg).vectors) {
          Vector3d left = vector;  // what is not spanned yet, about
          for (const Vector3d& other : spanned[end]) {
            const double square = other.squaredNorm();
            if (square > 0) {
              left -= left.dot(other) / square * other;
            }
          }
          gained += left.norm();
          with[end].push_back(vector);
        }
      }
      const double score = ranks(with) + 1e-3 * gained;
      if (score > most) {
        most = score;
        best = leg;
      }
    }
    for (std::size_t end = 0; end < 2; ++end) {
      const auto added = vectors_of(matching.from[end], best).vectors;
      spanned[end].insert(spanned[end].end(), added.begin(), added.end());
    }
    chosen.push_back(best);
  }
  return chosen;
}

// Whether all inner products of two legs' vectors, or of one's own, are those of two others.
bool same_products(const LegVectors& a, const LegVectors& b, const LegVectors& image_a,
                   const LegVectors& image_b, double tolerance) {
  for (std::size_t i = 0; i < a.vectors.size(); ++i) {
    for (std::size_t k = 0; k < b.vectors.size(); ++k) {
      double here = a.vectors[i].dot(b.vectors[k]);
      double there = image_a.vectors[i].dot(image_b.vectors[k]);
      if (i >= a.directed || k >= b.directed) {
        here = std::abs(here);
        there = std::abs(there);
      }
      if (std::abs(here - there) > tolerance) {
        return false;
      }
    }
  }
  return true;
}

class Matcher {
 public:
  explicit Matcher(const Matching& matching)
      : matching_(matching), count_(matching.mechanism->leg_count()) {
    for (std::size_t end = 0; end < 2; ++end) {
      for (Index leg = 0; leg < count_; ++leg) {
        from_[end].push_back(vectors_of(matching.from[end], leg));
        onto_[end].push_back(vectors_of(matching.onto[end], leg));
      }
      const Side& side = matching.onto[end];
      generous_[end] =
          std::min(0.5, kGenerous * (side.unit / side.size + matching.tolerance.angle) + 1e-9);
    }
    for (const bool improper : {false, true}) {
      for (Index i = 0; i < count_; ++i) {
        for (Index j = 0; j < count_; ++j) {
          links_[improper ? 1 : 0].push_back(
              matching.mechanism->of_one_chain(i, j)
                  ? links_apart(chain(i), matching.mechanism->leg(i), matching.mechanism->leg(j),
                                improper, matching.exchange, matching.tolerance)
                  : kInfinity);
        }
      }
    }
  }

  std::vector<FoundPair> run() {
    frame_ = frame_legs(matching_);
    images_.assign(frame_.size(), 0);
    extend(0);
    return std::move(found_);
  }

 private:
  const ChainInfo& chain(Index leg) const { return matching_.mechanism->model(leg).info(); }
  double links(Index from, Index onto, bool improper) const {
    return links_[improper ? 1 : 0][static_cast<std::size_t>(from * count_ + onto)];
  }

  // Images of the frame legs, one after the other.
  void extend(std::size_t next) {
    if (next == frame_.size()) {
      for (const int determinant :
           matching_.proper ? std::vector<int>{1} : std::vector<int>{1, -1}) {
        try_motions(determinant);
      }
      return;
    }
    for (Index image = 0; image < count_; ++image) {
      images_[next] = image;
      if (fits(next)) {
        extend(next + 1);
      }
    }
  }

  bool fits(std::size_t last) const {
    const auto at = [](Index leg) { return static_cast<std::size_t>(leg); };
    if (std::min(links(frame_[last], images_[last], false),
                 links(frame_[last], images_[last], true)) > kImageTolerances) {
      return false;
    }
    for (std::size_t k = 0; k <= last; ++k) {
      if (k < last && images_[k] == images_[last]) {
        return false;
      }
      for (std::size_t end = 0; end < 2; ++end) {
        if (!same_products(from_[end][at(frame_[last])], from_[end][at(frame_[k])],
                           onto_[end][at(images_[last])], onto_[end][at(images_[k])],
                           generous_[end])) {
          return false;
        }
      }
    }
    return true;
  }

  // All linear maps of one space that carry the frame legs, for each choice of senses.
  std::vector<Matrix3d> maps(std::size_t end, int determinant, const Matrix3d& otherwise) const {
    VectorPairs pairs;
    std::vector<std::size_t> undirected;
    for (std::size_t k = 0; k < frame_.size(); ++k) {
      const LegVectors& a = from_[end][static_cast<std::size_t>(frame_[k])];
      const LegVectors& b = onto_[end][static_cast<std::size_t>(images_[k])];
      for (std::size_t i = 0; i < a.vectors.size(); ++i) {
        if (i >= a.directed) {
          undirected.push_back(pairs.from.size());
        }
        pairs.from.push_back(a.vectors[i]);
        pairs.onto.push_back(b.vectors[i]);
      }
    }
    std::vector<Matrix3d> result;
    for (std::size_t signs = 0; signs < (std::size_t{1} << undirected.size()); ++signs) {
      VectorPairs chosen = pairs;
      for (std::size_t bit = 0; bit < undirected.size(); ++bit) {
        if ((signs >> bit & 1U) != 0) {
          chosen.onto[undirected[bit]] *= -1;
        }
      }
      const Matrix3d map = fit_orthogonal(chosen, determinant, matching_.threshold, otherwise);
      double worst = 0;
      for (std::size_t i = 0; i < chosen.from.size(); ++i) {
        worst = std::max(worst, (map * chosen.from[i] - chosen.onto[i]).norm());
      }
      const bool known = std::any_of(result.begin(), result.end(), [&](const Matrix3d& other) {
        return (other - map).cwiseAbs().maxCoeff() < 1e-6;
      });
      if (worst <= generous_[end] && !known) {
        result.push_back(map);
      }
    }
    return result;
  }

  Isometry about_centres(std::size_t end, const Matrix3d& linear) const {
    return {linear, matching_.onto[end].centre - linear * matching_.from[end].centre};
  }

  void try_motions(int determinant) {
    const Matrix3d& home = matching_.home;
    Matrix3d fallback = Matrix3d::Identity();
    if (determinant < 0) {
      // A mirror that leaves Z where it is.
      fallback(1, 1) = -1;
    }
    if (!matching_.turns) {
      for (const Matrix3d& base : maps(0, determinant, fallback)) {
        refine({about_centres(0, base), {base, Vector3d::Zero()}, false});
      }
      return;
    }
    // What one space leaves open is as the other has it, seen at home. (Where they exchange roles
    // both maps go the other way round, between the spaces.)
    const Matrix3d back = matching_.exchange ? home : home.transpose();
    const auto seen_from_base = [&](const Matrix3d& map) -> Matrix3d { return home * map * back; };
    const auto seen_from_platform = [&](const Matrix3d& map) -> Matrix3d {
      return home.transpose() * map * back.transpose();
    };
    if (matching_.from[0].rank < 2 && matching_.from[1].rank >= 2) {
      for (const Matrix3d& platform : maps(1, determinant, fallback)) {
        for (const Matrix3d& base : maps(0, determinant, seen_from_base(platform))) {
          refine({about_centres(0, base), about_centres(1, platform), false});
        }
      }
      return;
    }
    for (const Matrix3d& base : maps(0, determinant, fallback)) {
      for (const Matrix3d& platform : maps(1, determinant, seen_from_platform(base))) {
        refine({about_centres(0, base), about_centres(1, platform), false});
      }
    }
  }

  // How far the image of a leg's end is from another leg's, in tolerances.
  double ends_apart(std::size_t end, const Isometry& motion, Index from, Index onto) const {
    const EndFeatures& a = matching_.from[end].legs[static_cast<std::size_t>(from)];
    const EndFeatures& b = matching_.onto[end].legs[static_cast<std::size_t>(onto)];
    const double unit = matching_.onto[end].unit;
    const double angle = std::max(matching_.tolerance.angle, 1e-15);
    double most = 0;
    if (a.point.has_value()) {
      most = (motion(*a.point) - *b.point).norm() / unit;
    }
    for (std::size_t i = 0; i < a.lines.size(); ++i) {
      const LineFeature image{motion.linear * a.lines[i].direction, motion(a.lines[i].through),
                              a.lines[i].placed};
      most = std::max(most, image.direction.cross(b.lines[i].direction).norm() / angle);
      if (image.placed) {
        const Vector3d& centre = matching_.onto[end].centre;
        most = std::max(most, (foot(image, centre) - foot(b.lines[i], centre)).norm() / unit);
      }
    }
    for (std::size_t i = 0; i < a.directed.size(); ++i) {
      most = std::max(most, (motion.linear * a.directed[i] - b.directed[i]).norm() / angle);
    }
    return most;
  }

  // Each leg's nearest, by the end that is farther off; nothing unless these are all legs.
  std::optional<FoundPair> nearest(const SymmetryPair& pair) const {
    FoundPair result;
    result.pair = pair;
    std::vector<bool> hit(static_cast<std::size_t>(count_), false);
    const bool improper = pair.improper();
    for (Index leg = 0; leg < count_; ++leg) {
      Index best = -1;
      double least = kInfinity;
      for (Index other = 0; other < count_; ++other) {
        double off = links(leg, other, improper);
        if (off > kImageTolerances) {
          continue;
        }
        off = std::max(off, ends_apart(0, pair.base, leg, other));
        if (matching_.turns && off < least) {
          off = std::max(off, ends_apart(1, pair.platform, leg, other));
        }
        if (off < least) {
          least = off;
          best = other;
        }
      }
      if (best < 0 || hit[static_cast<std::size_t>(best)]) {
        return std::nullopt;
      }
      hit[static_cast<std::size_t>(best)] = true;
      result.permutation.push_back(best);
      result.in_tolerances = std::max(result.in_tolerances, least);
    }
    return result;
  }

  // The motion of one space that fits all legs best, with partners and senses as they are.
  Isometry refit(std::size_t end, const FoundPair& found) const {
    const Isometry& now = end == 0 ? found.pair.base : found.pair.platform;
    VectorPairs pairs;
    for (Index leg = 0; leg < count_; ++leg) {
      const auto onto = static_cast<std::size_t>(found.permutation[static_cast<std::size_t>(leg)]);
      const LegVectors& a = from_[end][static_cast<std::size_t>(leg)];
      const LegVectors& b = onto_[end][onto];
      for (std::size_t i = 0; i < a.vectors.size(); ++i) {
        const double sense =
            i >= a.directed && (now.linear * a.vectors[i]).dot(b.vectors[i]) < 0 ? -1 : 1;
        pairs.from.push_back(a.vectors[i]);
        pairs.onto.emplace_back(sense * b.vectors[i]);
      }
    }
    Isometry result = about_centres(
        end, fit_orthogonal(pairs, mirrors(now.linear) ? -1 : 1, matching_.threshold, now.linear));
    std::vector<Place> places;
    for (Index leg = 0; leg < count_; ++leg) {
      const auto onto = static_cast<std::size_t>(found.permutation[static_cast<std::size_t>(leg)]);
      const EndFeatures& a = matching_.from[end].legs[static_cast<std::size_t>(leg)];
      const EndFeatures& b = matching_.onto[end].legs[onto];
      if (a.point.has_value()) {
        places.push_back({*b.point - result.linear * *a.point, Matrix3d::Identity()});
      }
      for (std::size_t i = 0; i < a.lines.size(); ++i) {
        if (a.lines[i].placed) {
          places.push_back({b.lines[i].through - result.linear * a.lines[i].through,
                            across(b.lines[i].direction)});
        }
      }
    }
    result.shift = nearest_point(places, result.shift);
    return result;
  }

  void refine(const SymmetryPair& start) {
    std::optional<FoundPair> found = nearest(start);
    for (int round = 0; round < kRefits && found.has_value(); ++round) {
      SymmetryPair pair = found->pair;
      pair.base = refit(0, *found);
      pair.platform = matching_.turns ? refit(1, *found) : Isometry{pair.base.linear, {0, 0, 0}};
      found = nearest(pair);
    }
    if (!found.has_value() || found->in_tolerances > kImageTolerances) {
      return;
    }
    if (matching_.exchange) {  // fitted was what takes the base's ends to the platform's
      found->pair = {found->pair.base, inverse(found->pair.platform), true};
    }
    const double size = std::max(matching_.onto[0].size, matching_.onto[1].size);
    const bool known = std::any_of(found_.begin(), found_.end(), [&](const FoundPair& other) {
      return apart(other.pair, found->pair, size) < 1e-3;
    });
    if (!known) {
      found_.push_back(std::move(*found));
    }
  }

  const Matching& matching_;
  Index count_;
  std::array<std::vector<LegVectors>, 2> from_, onto_;
  std::array<std::vector<double>, 2> links_;
  std::array<double, 2> generous_{};
  std::vector<Index> frame_, images_;
  std::vector<FoundPair> found_;
};

Matrix3d rotation_at(const Mechanism& mechanism, ConstVector home) {
  const PoseSpace space = mechanism.pose_space();
  if (!has_orientation(space)) {
    return Matrix3d::Identity();
  }
  if (has_quaternion(space)) {
    return rotation_matrix(home.data() + position_size(space));
  }
  Matrix3d turn = Matrix3d::Identity();
  const double angle = home[position_size(space)];
  turn.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  return turn;
}

}  // namespace

Matching matching_of(const Mechanism& mechanism, ConstVector home,
                     const SymmetryTolerance& tolerance, bool exchange) {
  Matching matching;
  matching.mechanism = &mechanism;
  matching.tolerance = tolerance;
  matching.exchange = exchange;
  matching.turns = has_orientation(mechanism.pose_space());
  matching.proper = mechanism.pose_space() == PoseSpace::spherical;
  matching.home = rotation_at(mechanism, home);
  const bool planar = position_size(mechanism.pose_space()) == 2;
  matching.threshold = std::max(1e-3, 8 * tolerance.angle);
  const double unit = std::max(tolerance.length, 1e-15);
  std::array<std::vector<EndFeatures>, 2> ends;
  for (Index leg = 0; leg < mechanism.leg_count(); ++leg) {
    LegFeatures features = features_of(mechanism.model(leg).info(), mechanism.leg(leg));
    ends[0].push_back(std::move(features[0]));
    ends[1].push_back(std::move(features[1]));
  }
  matching.from = {side_of(ends[0], planar, unit, matching.threshold),
                   side_of(ends[1], planar, unit, matching.threshold)};
  matching.onto = matching.from;
  if (exchange) {
    std::swap(matching.from[0], matching.from[1]);
    // Vectors are compared with those that they arrive at.
    for (std::size_t end = 0; end < 2; ++end) {
      matching.from[end].size = matching.onto[end].size;
    }
  }
  return matching;
}

std::vector<FoundPair> matched(const Matching& matching) { return Matcher(matching).run(); }

}  // namespace symkin
