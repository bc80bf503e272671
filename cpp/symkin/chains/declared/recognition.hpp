// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "symkin/chains/declared/declared_model.hpp"

namespace symkin::declared {

// A number of a leg with its derivatives by the leg's parameters, which are left empty where nobody
// asks for them.
struct Dual {
  double value = 0;
  Vector slopes;
};

// The parameters of a declared leg where a number is asked for.
struct Asked {
  const double* parameters;
  Index slopes;  // how many, or none
};
using Source = std::function<Dual(const Asked&)>;

// A declared leg that is one of the known chains: the same joints that are read, the same platform,
// and no scalar but what the chain has a parameter for. It then is computed as that.
class Recognised {
 public:
  Recognised(const ChainModel& known, std::vector<Source> sources, Index hand)
      : known_(&known), sources_(std::move(sources)), hand_(hand) {}

  const ChainModel& known() const { return *known_; }
  // The known chain's parameters; false where it has none, as of a point on the axis about which
  // its own are counted. With slopes, by the declared ones.
  bool parameters(ConstVector declared, Vector& values, RowMatrix* slopes) const;
  int working_mode(ConstVector declared) const;
  void set_mode_at_home(int mode) { mode_ = mode; }

 private:
  const ChainModel* known_;
  std::vector<Source> sources_;
  Index hand_;
  int mode_ = 1;  // as drawn
};

// None where it is no known chain, or not the known chain's branch.
std::optional<Recognised> recognised(const Declaration& declaration);

}  // namespace symkin::declared
