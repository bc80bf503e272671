// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

// A rotation by 2 pi rotation / n, or a reflection about the line (in space: the plane through Z)
// at the group's axis + pi rotation / n. Labels: r0, r1, ... and s0, s1, ...
struct SymmetryElement {
  int rotation = 0;
  bool reflection = false;

  friend bool operator==(const SymmetryElement& a, const SymmetryElement& b) {
    return a.rotation == b.rotation && a.reflection == b.reflection;
  }
};

// Where the symmetry stands in the two frames: it turns about `centre` of each, and the reflection
// s0 is about the line at `axis` through it. For a mechanism drawn about its origin both centres
// are zero and both axes equal.
struct SymmetryFrame {
  Eigen::Vector2d base_centre = Eigen::Vector2d::Zero();      // m
  Eigen::Vector2d platform_centre = Eigen::Vector2d::Zero();  // m, platform frame
  double base_axis = 0;                                       // rad
  double platform_axis = 0;                                   // rad, platform frame

  static SymmetryFrame about_origin(double axis) { return {{0, 0}, {0, 0}, axis, axis}; }
};

// C_n (n rotations) or D_n (n rotations and n reflections) about Z. The paper writes the dihedral
// group of 2n elements D_2n.
class SymmetryGroup {
 public:
  SymmetryGroup(int order_of_rotation, bool dihedral, SymmetryFrame frame = {});
  // "C3", "D3": the usual names. Throws InvalidInput otherwise.
  static SymmetryGroup named(std::string_view name, double axis = 0);

  int rotations() const { return rotations_; }
  bool dihedral() const { return dihedral_; }
  int size() const { return dihedral_ ? 2 * rotations_ : rotations_; }
  const SymmetryFrame& frame() const { return frame_; }
  std::string name() const;        // "C_3", "D_3"
  std::string paper_name() const;  // "C_3", "D_6"

  // r0, r1, ..., s0, s1, ... An element of another group throws InvalidInput everywhere.
  std::vector<SymmetryElement> elements() const;
  SymmetryElement compose(SymmetryElement outer, SymmetryElement inner) const;
  SymmetryElement inverse(SymmetryElement element) const;

  static std::string label(SymmetryElement element);
  SymmetryElement parse(std::string_view label) const;  // throws InvalidInput

  // Angle of the rotation, or the reflection line's angle from the group's axis; radians.
  double angle(SymmetryElement element) const;

 private:
  void check(SymmetryElement element) const;
  std::string expected_labels() const;
  int wrap(int rotation) const;

  int rotations_;
  bool dihedral_;
  SymmetryFrame frame_;
};

}  // namespace symkin
