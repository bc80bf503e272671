// SPDX-License-Identifier: MIT
#include "symkin/design/branch_and_bound.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <queue>

#include "symkin/design/approximate_design.hpp"
#include "symkin/design/certificate.hpp"
#include "symkin/design/clusters.hpp"
#include "symkin/design/information.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/random.hpp"

namespace symkin {
namespace {

constexpr double kIntegral = 1e-5;  // what differs less from a whole number is one
constexpr double kShare = 0.1;  // of what the relaxation is above the incumbent: a gap to stop at

// Choices that take between lower and upper of each group of candidates, and their relaxation.
struct Node {
  std::vector<Index> members;  // positions
  DesignGroups groups;
  Vector weights, variances;
  double log_det = 0;  // of the weights
  double bound = 0;    // of every choice in the node
  Index id = 0;
  bool solved_again = false;
};

struct LowerBound {
  bool operator()(const Node& a, const Node& b) const {
    return a.bound < b.bound || (a.bound == b.bound && a.id > b.id);
  }
};

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

bool whole(double value) { return std::abs(value - std::round(value)) < kIntegral; }

std::vector<double> group_sums(const Node& node) {
  std::vector<double> sums(node.groups.lower.size(), 0);
  for (std::size_t k = 0; k < node.members.size(); ++k) {
    sums[at(node.groups.of[k])] += node.weights[static_cast<Index>(k)];
  }
  return sums;
}

class BranchAndBound {
 public:
  explicit BranchAndBound(const ProofProblem& problem)
      : problem_(problem),
        points_(candidate_points(problem.candidates, problem.shape.parameters)),
        random_(1),
        start_(Clock::now()) {
    proof_.best = problem.incumbent;
    proof_.log_det = problem.log_det;
  }

  Proof run() {
    Node root = root_node();
    proof_.bound = std::numeric_limits<double>::infinity();
    add(root);
    while (!open_.empty() && open_.top().bound > goal() && !out_of_time()) {
      check_interrupt();
      const Node node = open_.top();
      open_.pop();
      branch(node);
    }
    proof_.bound = std::max(goal(), unresolved_);
    if (!open_.empty()) {
      proof_.bound = std::max(proof_.bound, open_.top().bound);
    }
    proof_.proven = proof_.bound <= goal();
    return proof_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  // A node is of no use unless its bound is above this.
  double goal() const { return proof_.log_det + kProofTolerance; }

  bool out_of_time() const {
    return std::chrono::duration<double>(Clock::now() - start_).count() > problem_.time_limit_s;
  }

  Node root_node() const {
    Node root;
    const Index n = problem_.candidates.count();
    for (Index j = 0; j < n; ++j) {
      root.members.push_back(j);
    }
    root.groups.of = farthest_first_clusters(points_, problem_.clusters);
    const Index groups = *std::max_element(root.groups.of.begin(), root.groups.of.end()) + 1;
    root.groups.lower.assign(at(groups), 0);
    root.groups.upper.assign(at(groups), static_cast<double>(problem_.count));
    root.weights = Vector::Zero(n);
    for (const Index j : problem_.incumbent) {
      root.weights[j] = 1;
    }
    root.variances = Vector::Zero(n);
    root.bound = std::numeric_limits<double>::infinity();
    return root;
  }

  // Weights that keep the groups' bounds, near those given: what is too much goes in proportion,
  // what is missing goes to the largest variances. False if no choice keeps the bounds.
  bool make_feasible(Node& node) const {
    const auto groups = node.groups.lower.size();
    std::vector<double> sizes(groups, 0);
    for (const Index g : node.groups.of) {
      sizes[at(g)] += 1;
    }
    double least = 0;
    double most = 0;
    for (std::size_t g = 0; g < groups; ++g) {
      node.groups.upper[g] = std::min(node.groups.upper[g], sizes[g]);
      if (node.groups.lower[g] > node.groups.upper[g]) {
        return false;
      }
      least += node.groups.lower[g];
      most += node.groups.upper[g];
    }
    const auto total = static_cast<double>(problem_.count);
    if (least > total || most < total) {
      return false;
    }
    std::vector<double> sums = group_sums(node);
    scale_down(node, sums, node.groups.upper);
    std::vector<Index> order(node.members.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      order[k] = static_cast<Index>(k);
    }
    std::sort(order.begin(), order.end(),
              [&](Index a, Index b) { return node.variances[a] > node.variances[b]; });
    fill(node, sums, node.groups.lower, total * static_cast<double>(groups), order);
    double sum = 0;
    double slack = 0;
    for (std::size_t g = 0; g < groups; ++g) {
      sum += sums[g];
      slack += sums[g] - node.groups.lower[g];
    }
    if (sum > total) {
      std::vector<double> goals(groups);
      for (std::size_t g = 0; g < groups; ++g) {
        goals[g] = sums[g] - (sum - total) * (sums[g] - node.groups.lower[g]) / slack;
      }
      scale_down(node, sums, goals);
    } else {
      fill(node, sums, node.groups.upper, total - sum, order);
    }
    return true;
  }

  static void scale_down(Node& node, std::vector<double>& sums, const std::vector<double>& most) {
    for (std::size_t k = 0; k < node.members.size(); ++k) {
      const auto g = at(node.groups.of[k]);
      if (sums[g] > most[g]) {
        node.weights[static_cast<Index>(k)] *= most[g] / sums[g];
      }
    }
    for (std::size_t g = 0; g < sums.size(); ++g) {
      sums[g] = std::min(sums[g], most[g]);
    }
  }

  static void fill(Node& node, std::vector<double>& sums, const std::vector<double>& most,
                   double amount, const std::vector<Index>& order) {
    for (const Index k : order) {
      const auto g = at(node.groups.of[at(k)]);
      const double room = std::min({most[g] - sums[g], 1 - node.weights[k], amount});
      if (room > 0) {
        node.weights[k] += room;
        sums[g] += room;
        amount -= room;
      }
    }
  }

  // Solves the relaxation; the node is kept if it may hold something better. Returns whether.
  bool add(Node& node) {
    if (!make_feasible(node)) {
      return false;
    }
    ++proof_.nodes;
    node.id = proof_.nodes;
    const ColumnBlocks rows = gather(node.members);
    const DesignProblem relaxation{
        rows, problem_.shape, problem_.fixed, static_cast<double>(problem_.count), 1, &node.groups};
    DesignOptions options;
    options.gap = kProofTolerance / 10;
    options.target = goal();
    options.share = kShare;
    ApproximateDesign design = optimise_design(relaxation, node.weights, options, random_);
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

  ColumnBlocks gather(const std::vector<Index>& members) const {
    ColumnBlocks rows(static_cast<Index>(members.size()), problem_.candidates.columns());
    std::vector<double> row(at(problem_.candidates.columns()));
    for (std::size_t k = 0; k < members.size(); ++k) {
      problem_.candidates.get(members[k], row.data());
      rows.set(static_cast<Index>(k), row.data());
    }
    return rows;
  }

  void try_rounding(const Node& node) {
    std::vector<Index> order(node.members.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      order[k] = static_cast<Index>(k);
    }
    const auto last = order.begin() + static_cast<std::ptrdiff_t>(problem_.count);
    std::partial_sort(order.begin(), last, order.end(), [&](Index a, Index b) {
      return node.weights[a] != node.weights[b] ? node.weights[a] > node.weights[b]
                                                : node.variances[a] > node.variances[b];
    });
    RowMatrix matrix = problem_.fixed;
    RowMatrix rows(problem_.shape.rows, problem_.shape.parameters);
    std::vector<Index> chosen;
    for (auto k = order.begin(); k != last; ++k) {
      chosen.push_back(node.members[at(*k)]);
      problem_.candidates.get(chosen.back(), rows.data());
      matrix += rows.transpose() * rows;
    }
    const RowMatrix factor = inverse_factor(matrix);
    if (factor.size() != 0 && log_determinant(factor) > proof_.log_det) {
      proof_.log_det = log_determinant(factor);
      proof_.best = chosen;
    }
  }

  // With a candidate forced in, some other leaves the largest sum (an exchange of bases): if even
  // without the least of it too little remains, no better choice of the node has the candidate.
  void drop_hopeless(Node& node, const ApproximateDesign& design) const {
    const auto p = static_cast<double>(problem_.shape.parameters);
    const double at_p = determinant_bound(design.factor, p);
    const double needed = p * std::exp((goal() - at_p) / p) - design.trace + design.least;
    Node kept;
    for (std::size_t k = 0; k < node.members.size(); ++k) {
      const auto index = static_cast<Index>(k);
      if (node.weights[index] > 0 || node.variances[index] >= needed) {
        const auto place = static_cast<Index>(kept.members.size());
        kept.members.push_back(node.members[k]);
        kept.groups.of.push_back(node.groups.of[k]);
        node.weights[place] = node.weights[index];
        node.variances[place] = node.variances[index];
      }
    }
    const auto size = static_cast<Index>(kept.members.size());
    node.members = std::move(kept.members);
    node.groups.of = std::move(kept.groups.of);
    node.weights.conservativeResize(size);
    node.variances.conservativeResize(size);
  }

  void branch(const Node& node) {
    const std::vector<double> sums = group_sums(node);
    std::size_t group = 0;
    double most = 0;
    for (std::size_t g = 0; g < sums.size(); ++g) {
      const double part = std::abs(sums[g] - std::round(sums[g]));
      if (part > most) {
        most = part;
        group = g;
      }
    }
    if (most > kIntegral) {
      add_between(node, group, node.groups.lower[group], std::floor(sums[group]));
      add_between(node, group, std::ceil(sums[group]), node.groups.upper[group]);
      return;
    }
    for (std::size_t k = 0; k < node.members.size(); ++k) {
      if (!whole(node.weights[static_cast<Index>(k)])) {
        branch_inside(node, at(node.groups.of[k]), std::round(sums[at(node.groups.of[k])]));
        return;
      }
    }
    solve_again(node);
  }

  void add_between(const Node& node, std::size_t group, double lower, double upper) {
    if (lower <= upper) {
      Node child = node;
      child.groups.lower[group] = lower;
      child.groups.upper[group] = upper;
      add(child);
    }
  }

  // The weight of the group is whole, those in it are not. Once its sum is fixed it is cut in two.
  void branch_inside(const Node& node, std::size_t group, double sum) {
    if (node.groups.lower[group] < node.groups.upper[group]) {
      add_between(node, group, node.groups.lower[group], sum - 1);
      add_between(node, group, sum, sum);
      add_between(node, group, sum + 1, node.groups.upper[group]);
      return;
    }
    Node halves = node;
    const double first = cut(halves, group);
    // The relaxation is a concave function of the weight of one half: beyond a value that is no
    // better than the incumbent there are no better ones, if it starts above.
    const bool concave = node.log_det > goal();
    for (double k = std::floor(first); k >= 0; --k) {
      if (!add_halves(halves, group, k, sum - k) && concave) {
        break;
      }
    }
    for (double k = std::floor(first) + 1; k <= sum; ++k) {
      if (!add_halves(halves, group, k, sum - k) && concave) {
        break;
      }
    }
  }

  bool add_halves(const Node& halves, std::size_t group, double first, double second) {
    Node child = halves;
    child.groups.lower[group] = child.groups.upper[group] = first;
    child.groups.lower.back() = child.groups.upper.back() = second;
    return add(child);
  }

  // Two fractional members of the group far from each other draw the others to their side. The
  // second half becomes the last group; returns the weight of the first.
  double cut(Node& node, std::size_t group) const {
    std::vector<Index> fractional;
    for (std::size_t k = 0; k < node.members.size(); ++k) {
      if (at(node.groups.of[k]) == group && !whole(node.weights[static_cast<Index>(k)])) {
        fractional.push_back(node.members[k]);
      }
    }
    const auto distance = [&](Index a, Index b) {
      return (points_.row(a) - points_.row(b)).squaredNorm();
    };
    const Index one = fractional.front();
    const Index other =
        *std::max_element(fractional.begin(), fractional.end(),
                          [&](Index a, Index b) { return distance(one, a) < distance(one, b); });
    double weight = 0;
    const auto second = static_cast<Index>(node.groups.lower.size());
    for (std::size_t k = 0; k < node.members.size(); ++k) {
      if (at(node.groups.of[k]) != group) {
        continue;
      }
      const Index j = node.members[k];
      if (j == other || (j != one && distance(j, other) < distance(j, one))) {
        node.groups.of[k] = second;
      } else {
        weight += node.weights[static_cast<Index>(k)];
      }
    }
    node.groups.lower.push_back(0);
    node.groups.upper.push_back(0);
    return weight;
  }

  // The relaxation is a choice itself, by now the incumbent: only its gap is open.
  void solve_again(const Node& node) {
    if (node.solved_again) {
      unresolved_ = std::max(unresolved_, node.bound);
      return;
    }
    Node again = node;
    again.solved_again = true;
    add(again);
  }

  const ProofProblem& problem_;
  RowMatrix points_;
  Random random_;
  Clock::time_point start_;
  Proof proof_;
  double unresolved_ = -std::numeric_limits<double>::infinity();
  std::priority_queue<Node, std::vector<Node>, LowerBound> open_;
};

}  // namespace

Proof prove_optimum(const ProofProblem& problem) { return BranchAndBound(problem).run(); }

}  // namespace symkin
