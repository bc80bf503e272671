// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <queue>
#include <utility>

#include "symkin/design/detail/bounds.hpp"
#include "symkin/design/detail/search.hpp"
#include "symkin/support/dense.hpp"
#include "symkin/support/interrupt.hpp"

namespace symkin::design::detail {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kProofTolerance = 1e-8;  // of log det: what is better by less is not looked for
constexpr double kIntegral = 1e-5;        // what differs less from a whole number is one
constexpr double kShare = 0.1;  // of what the relaxation is above the incumbent: a gap to stop at
constexpr double kGap = 1e-6;   // of the design that sorts candidates out

// Choices that take between lower and upper of each group of candidates, and their relaxation.
struct Node {
  Indices members;  // positions
  DesignGroups groups;
  Vector weights, variances;
  double log_det = 0;  // of the weights
  double bound = 0;    // of every choice in the node
  Index id = 0;
  bool solved_again = false;

  bool operator<(const Node& other) const {
    return bound < other.bound || (bound == other.bound && id > other.id);
  }
  Index size() const { return size_of(members); }
  Index group(Index k) const { return at(groups.of, k); }
};

bool whole(double value) { return std::abs(value - std::round(value)) < kIntegral; }

std::vector<double> group_sums(const Node& node) {
  std::vector<double> sums(node.groups.lower.size(), 0);
  for (Index k = 0; k < node.size(); ++k) {
    at(sums, node.group(k)) += node.weights[k];
  }
  return sums;
}

// Weights that keep the groups' bounds, near those given: groups that hold too much lose in
// proportion, what is missing goes to their largest variances. False if no choice of so many keeps
// the bounds.
bool make_feasible(Node& node, double total) {
  std::vector<double>& upper = node.groups.upper;
  const std::vector<double>& lower = node.groups.lower;
  std::vector<Indices> of_group(upper.size());
  for (Index k = 0; k < node.size(); ++k) {
    at(of_group, node.group(k)).push_back(k);
  }
  const std::vector<double> sums = group_sums(node);
  std::vector<double> goals(sums.size());
  bool possible = true;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    upper[g] = std::min(upper[g], static_cast<double>(of_group[g].size()));
    possible = possible && lower[g] <= upper[g];
    goals[g] = std::max(lower[g], std::min(upper[g], sums[g]));
  }
  const auto sum_of = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
  };
  if (!possible || sum_of(lower) > total || sum_of(upper) < total) {
    return false;
  }
  const double sum = sum_of(goals);
  const std::vector<double>& limit = sum < total ? upper : lower;
  const double room = sum_of(limit) - sum;
  const double share = room == 0 ? 0 : (total - sum) / room;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    goals[g] += share * (limit[g] - goals[g]);
    std::sort(of_group[g].begin(), of_group[g].end(),
              [&](Index a, Index b) { return node.variances[a] > node.variances[b]; });
    double missing = goals[g] - sums[g];
    for (const Index k : of_group[g]) {
      double& weight = node.weights[k];
      const double more = std::min(1 - weight, missing);
      weight = missing < 0 ? weight * goals[g] / sums[g] : weight + more;
      missing -= missing < 0 ? 0 : more;
    }
  }
  return true;
}

// A proof that no choice of the candidates is better than a known one, or a better one.
class BranchAndBound {
 public:
  // The candidates are those that can be in a better choice, and the chosen ones. The proof does
  // not depend on the number of clusters to start from; its time does.
  BranchAndBound(const Problem& problem, const Indices& candidates, const Indices& chosen,
                 Index clusters, Clock::time_point start)
      : log_det(problem.log_det(chosen) - problem.whitening.log_det),
        problem_(problem),
        candidates_(problem.whitened(candidates)),
        points_(candidate_points(candidates_)),
        start_(start) {
    for (const Index candidate : chosen) {
      best.push_back(std::lower_bound(candidates.begin(), candidates.end(), candidate) -
                     candidates.begin());
    }
    Node root = root_node(clusters);
    add(root);
    while (!open_.empty() && open_.top().bound > goal() && !out_of_time()) {
      check_interrupt();
      const Node node = open_.top();
      open_.pop();
      branch(node);
    }
    bound = std::max(goal(), unresolved_);
    if (!open_.empty()) {
      bound = std::max(bound, open_.top().bound);
    }
    proven = bound <= goal();
  }

  Indices best;              // places in the list of candidates
  double log_det;            // of the best, whitened
  double bound = kInfinity;  // no choice has a larger log_det
  bool proven = false;       // bound <= log_det + kProofTolerance
  Index nodes = 0;

 private:
  bool out_of_time() const {
    const std::chrono::duration<double> used = Clock::now() - start_;
    return used.count() > problem_.options.time_limit_s;
  }

  // A node is of no use unless its bound is above this.
  double goal() const { return log_det + kProofTolerance; }
  double count() const { return static_cast<double>(problem_.free_count); }

  Node root_node(Index clusters) const {
    Node root;
    const Index n = candidates_.count();
    root.members.resize(static_cast<std::size_t>(n));
    std::iota(root.members.begin(), root.members.end(), Index{0});
    root.groups.of = farthest_first_clusters(points_, clusters);
    const Index groups = *std::max_element(root.groups.of.begin(), root.groups.of.end()) + 1;
    root.groups.lower.assign(static_cast<std::size_t>(groups), 0);
    root.groups.upper.assign(static_cast<std::size_t>(groups), count());
    root.weights = root.variances = Vector::Zero(n);
    for (const Index j : best) {
      root.weights[j] = 1;
    }
    root.bound = kInfinity;
    return root;
  }

  // Solves the relaxation; the node is kept if it may hold something better. Returns whether.
  bool add(Node& node) {
    if (!make_feasible(node, count())) {
      return false;
    }
    node.id = ++nodes;
    const ColumnBlocks rows(candidates_.rows(node.members), candidates_.shape().rows);
    DesignOptions options;
    options.gap = kProofTolerance / 10;
    options.target = goal();
    options.share = kShare;
    ApproximateDesign design = optimise_design(
        {rows, problem_.whitened_fixed, count(), 1, node.groups}, node.weights, options);
    node.bound = std::min(node.bound, determinant_bound(design.factor, design.trace));
    node.weights = std::move(design.weights);
    node.variances = std::move(design.variances);
    node.log_det = design.log_det;
    if (node.bound <= goal()) {
      return false;
    }
    try_rounding(node);
    drop_hopeless(node, design);
    open_.push(node);
    return true;
  }

  void try_rounding(const Node& node) {
    Indices order(node.members.size());
    std::iota(order.begin(), order.end(), Index{0});
    const auto last = order.begin() + problem_.free_count;
    std::partial_sort(order.begin(), last, order.end(), [&](Index a, Index b) {
      return std::make_pair(-node.weights[a], -node.variances[a]) <
             std::make_pair(-node.weights[b], -node.variances[b]);
    });
    order.erase(last, order.end());
    const Indices chosen = named(order, node.members);
    const RowMatrix rows = candidates_.rows(chosen);
    const RowMatrix factor =
        inverse_factor(problem_.whitened_fixed + product(rows.transpose(), rows));
    if (factor.size() != 0 && log_determinant(factor) > log_det) {
      log_det = log_determinant(factor);
      best = chosen;
    }
  }

  // With a candidate forced in, some other leaves the largest sum (an exchange of bases): if even
  // without the least of it too little remains, no better choice of the node has the candidate.
  void drop_hopeless(Node& node, const ApproximateDesign& design) const {
    const auto p = static_cast<double>(problem_.parameters());
    const double at_p = determinant_bound(design.factor, p);
    const double needed = p * std::exp((goal() - at_p) / p) - design.trace + design.least;
    Indices kept;
    for (Index k = 0; k < node.size(); ++k) {
      if (node.weights[k] > 0 || node.variances[k] >= needed) {
        kept.push_back(k);
      }
    }
    node.members = named(kept, node.members);
    node.groups.of = named(kept, node.groups.of);
    node.weights = node.weights(kept).eval();
    node.variances = node.variances(kept).eval();
  }

  void branch(const Node& node) {
    const std::vector<double> sums = group_sums(node);
    Index group = 0;
    double most = 0;
    for (Index g = 0; g < size_of(sums); ++g) {
      const double part = std::abs(at(sums, g) - std::round(at(sums, g)));
      if (part > most) {
        most = part;
        group = g;
      }
    }
    if (most > kIntegral) {
      add_between(node, group, at(node.groups.lower, group), std::floor(at(sums, group)));
      add_between(node, group, std::ceil(at(sums, group)), at(node.groups.upper, group));
      return;
    }
    for (Index k = 0; k < node.size(); ++k) {
      if (!whole(node.weights[k])) {
        branch_inside(node, node.group(k), std::round(at(sums, node.group(k))));
        return;
      }
    }
    // The relaxation is a choice itself, by now the incumbent: only its gap is open.
    Node again = node;
    again.solved_again = true;
    if (node.solved_again) {
      unresolved_ = std::max(unresolved_, node.bound);
    } else {
      add(again);
    }
  }

  void add_between(const Node& node, Index group, double lower, double upper) {
    if (lower <= upper) {
      Node child = node;
      at(child.groups.lower, group) = lower;
      at(child.groups.upper, group) = upper;
      add(child);
    }
  }

  // The weight of the group is whole, those in it are not. Once its sum is fixed it is cut in two.
  void branch_inside(const Node& node, Index group, double sum) {
    if (at(node.groups.lower, group) < at(node.groups.upper, group)) {
      add_between(node, group, at(node.groups.lower, group), sum - 1);
      add_between(node, group, sum, sum);
      add_between(node, group, sum + 1, at(node.groups.upper, group));
      return;
    }
    Node halves = node;
    const double first = cut(halves, group);
    // The relaxation is a concave function of the weight of one half: beyond a value that is no
    // better than the incumbent there are no better ones, if it starts above.
    const bool concave = node.log_det > goal();
    const auto worth_more = [&](double k) {
      return k >= 0 && k <= sum && (add_halves(halves, group, k, sum - k) || !concave);
    };
    for (double k = std::floor(first); worth_more(k); --k) {
    }
    for (double k = std::floor(first) + 1; worth_more(k); ++k) {
    }
  }

  bool add_halves(const Node& halves, Index group, double first, double second) {
    Node child = halves;
    at(child.groups.lower, group) = at(child.groups.upper, group) = first;
    child.groups.lower.back() = child.groups.upper.back() = second;
    return add(child);
  }

  // Two fractional members of the group far from each other draw the others to their side. The
  // second half becomes the last group; returns the weight of the first.
  double cut(Node& node, Index group) const {
    const auto distance = [&](Index a, Index b) {
      return (points_.row(a) - points_.row(b)).squaredNorm();
    };
    Indices fractional;
    for (Index k = 0; k < node.size(); ++k) {
      if (node.group(k) == group && !whole(node.weights[k])) {
        fractional.push_back(at(node.members, k));
      }
    }
    const Index one = fractional.front();
    const Index other =
        *std::max_element(fractional.begin(), fractional.end(),
                          [&](Index a, Index b) { return distance(one, a) < distance(one, b); });
    double weight = 0;
    for (Index k = 0; k < node.size(); ++k) {
      const Index j = at(node.members, k);
      if (node.group(k) != group) {
        continue;
      }
      if (j == other || (j != one && distance(j, other) < distance(j, one))) {
        at(node.groups.of, k) = size_of(node.groups.lower);
      } else {
        weight += node.weights[k];
      }
    }
    node.groups.lower.push_back(0);
    node.groups.upper.push_back(0);
    return weight;
  }

  const Problem& problem_;
  ColumnBlocks candidates_;  // whitened
  RowMatrix points_;
  Clock::time_point start_;
  double unresolved_ = -kInfinity;
  std::priority_queue<Node> open_;
};

// Candidates that a better choice can have, and the chosen ones: with S_N the sum of the N largest
// d_j, one that is forced in leaves at most S_N - d_(N) + d_j.
Indices promising(const Problem& problem, const RowMatrix& factor, const Indices& chosen) {
  const auto p = static_cast<double>(problem.parameters());
  const RowMatrix transform = problem.own_transform(factor);
  const LargestRatio top = largest_trace(problem, transform, problem.free_count);
  Indices result = chosen;
  if (!top.favoured.empty()) {  // else no candidate shows anything
    const double goal = problem.log_det(chosen) + kProofTolerance;
    const double needed = p * std::exp((goal - determinant_bound(transform, p)) / p) - top.value +
                          top.favoured.back().value;
    // Zero is no candidate's value, so that the floor leaves out the excluded ones.
    const auto kept = screen_candidates(
        problem.candidates, {{transform, problem.candidates.available(), std::max(0.0, needed)}});
    result = joined(result, indices_of(kept.front()));
  }
  return result;
}

}  // namespace

Selection select_exhaustive(const Problem& problem) {
  const auto start = Clock::now();
  Selection choice = select_exchange(problem);
  const DesignBounds bounds = bound_designs(problem, kGap);
  const Indices kept = promising(problem, bounds.distinct.factor, choice.indices);
  // A good set has its poses near those that the design with repeats would measure again and
  // again; somewhat more clusters than these need the fewest nodes.
  const Index clusters = 4 * (bounds.repeats.weights.array() > 1e-3).count() / 3 + 1;
  const BranchAndBound proof(problem, kept, choice.indices, clusters, start);
  choice.nodes = proof.nodes;
  choice.indices = named(proof.best, kept);
  Certificate& certificate = choice.certificate;
  certificate.proven_optimal = proof.proven;
  certificate.tighten(
      bounds.certificate.log_det_bound_repeats,
      std::min(bounds.certificate.log_det_bound_distinct, proof.bound + problem.whitening.log_det));
  return choice;
}

}  // namespace symkin::design::detail
