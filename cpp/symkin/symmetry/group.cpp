// SPDX-License-Identifier: MIT
#include "symkin/symmetry/group.hpp"

#include <charconv>
#include <cmath>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr int kMostRotations = 100'000;  // no mechanism has so many legs

// The number behind the first letter; -1 if there is none.
int number_after_letter(std::string_view text) {
  int number = -1;
  if (text.size() > 1) {
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + 1, end, number);
    if (error != std::errc() || stop != end) {
      return -1;
    }
  }
  return number;
}

}  // namespace

SymmetryGroup::SymmetryGroup(int order_of_rotation, bool dihedral, SymmetryFrame frame)
    : rotations_(order_of_rotation), dihedral_(dihedral), frame_(std::move(frame)) {
  if (rotations_ < 1 || rotations_ > kMostRotations) {
    throw InvalidInput("a symmetry group has 1 to " + std::to_string(kMostRotations) +
                       " rotations; got " + std::to_string(rotations_));
  }
}

SymmetryGroup SymmetryGroup::named(std::string_view name, double axis) {
  const int rotations = number_after_letter(name);
  const char kind = name.empty() ? ' ' : name.front();
  if (rotations < 1 || (kind != 'C' && kind != 'D')) {
    throw InvalidInput("unknown symmetry group \"" + std::string(name) +
                       "\"; expected C1, C2, ... (rotations) or D1, D2, ... (with reflections)");
  }
  return {rotations, kind == 'D', SymmetryFrame::about_origin(axis)};
}

std::string SymmetryGroup::name() const {
  return (dihedral_ ? "D_" : "C_") + std::to_string(rotations_);
}

std::string SymmetryGroup::paper_name() const {
  return (dihedral_ ? "D_" : "C_") + std::to_string(size());
}

std::vector<SymmetryElement> SymmetryGroup::elements() const {
  std::vector<SymmetryElement> all;
  for (const bool reflection : {false, true}) {
    for (int m = 0; m < rotations_ && (dihedral_ || !reflection); ++m) {
      all.push_back({m, reflection});
    }
  }
  return all;
}

// An element is Rot(m) Ref^f, and Ref Rot(m) = Rot(-m) Ref.
SymmetryElement SymmetryGroup::compose(SymmetryElement outer, SymmetryElement inner) const {
  check(outer);
  check(inner);
  const int turn = outer.reflection ? -inner.rotation : inner.rotation;
  return {wrap(outer.rotation + turn), outer.reflection != inner.reflection};
}

SymmetryElement SymmetryGroup::inverse(SymmetryElement element) const {
  check(element);
  return element.reflection ? element : SymmetryElement{wrap(-element.rotation), false};
}

std::string SymmetryGroup::label(SymmetryElement element) {
  return (element.reflection ? "s" : "r") + std::to_string(element.rotation);
}

SymmetryElement SymmetryGroup::parse(std::string_view label) const {
  const int rotation = number_after_letter(label);
  const bool reflection = !label.empty() && label.front() == 's';
  const bool known = !label.empty() && (label.front() == 'r' || (reflection && dihedral_));
  if (!known || rotation < 0 || rotation >= rotations_) {
    throw InvalidInput("\"" + std::string(label) + "\" is no element of " + name() + "; " +
                       expected_labels());
  }
  return {rotation, reflection};
}

void SymmetryGroup::check(SymmetryElement element) const {
  if (element.rotation < 0 || element.rotation >= rotations_ ||
      (element.reflection && !dihedral_)) {
    throw InvalidInput(label(element) + " is no element of " + name() + "; " + expected_labels());
  }
}

double SymmetryGroup::angle(SymmetryElement element) const {
  check(element);
  return (element.reflection ? kPi : 2 * kPi) * element.rotation / rotations_;
}

std::string SymmetryGroup::expected_labels() const {
  const std::string last = std::to_string(rotations_ - 1);
  return "expected r0 to r" + last + (dihedral_ ? " or s0 to s" + last : "");
}

int SymmetryGroup::wrap(int rotation) const {
  return ((rotation % rotations_) + rotations_) % rotations_;
}

}  // namespace symkin
