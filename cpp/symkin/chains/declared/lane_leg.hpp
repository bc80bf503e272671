// SPDX-License-Identifier: MIT
#pragma once

#include "symkin/chains/declared/description.hpp"

// A declared leg as the kernels take it that close several poses side by side: plain numbers alone,
// since what is compiled for other processors must not share a type of Eigen with the rest.
namespace symkin::declared {

inline constexpr int kMostEquations = 16;
inline constexpr int kMostJoints = 16;

// Of a number of the leg: `factor` times the scalar stands in that slot.
struct Part {
  Slot slot;
  int scalar;
  double factor;
};

struct Parts {
  const Part* first = nullptr;
  int count = 0;
};

struct LaneJoint {
  JointKind kind;
  int along;  // of its own frame's axes, or -1
  double axis[3];
  int column;  // of the joint that stands by itself and moves it, or -1: the pose's turn about z
  bool own;
  double offset;
  Parts ratio;
};

struct LanePath {
  const Step* steps;
  int count;
  int fixed, posed;   // the first step that depends on the pose, and the first behind it on joints
  const int* frames;  // of each step, and of the end, among those of all paths
  // As many of its first steps are an earlier path's, whose frames they have; from which of those
  // it goes its own way.
  int shared, leaves;
};

struct LaneLoop {
  LanePath left, right;
  Compares compares;
  int length_transform, length_joint;
};

// A fixed transform's numbers, matrices by columns.
struct LaneTransform {
  double rotation[9], translation[3], axes[3 * kSlots];
  double length;  // its x
  bool turns;
  Parts parts;
};

// How independent columns are mirrored into axes, one after the other. A joint moves the ends of
// few loops, so that most numbers are zero whatever the joints' values: where there are equations
// of one loop alone, its joints are taken first and mirrored into them.
struct Elimination {
  struct Mirror {
    int column;
    // Where the column may differ from zero then: first where the mirror does, beginning with the
    // axis.
    int row_count, mirrored, rows[kMostEquations];
    int earlier_count, earlier[kMostJoints];  // mirrors that change the column
  };
  Mirror mirrors[kMostJoints] = {};
  int rank = 0;
  int left[kMostEquations] = {};  // axes that remain
  double sign = 1;                // of the orders of columns and axes
};

struct LaneLeg {
  const LaneLoop* loops;
  int loop_count;
  const LaneJoint* joints;
  const double* ratios;  // of all joints, to what they follow
  int joint_count;
  const LaneTransform* transforms;
  int frame_count, scalar_count;

  int equations;
  const double* home;  // of the joints that stand by themselves
  int own_count;
  const Elimination *moving, *passive;  // of the columns of joints that move anything
  int read;                             // the first that is, or -1
  // The sign of d/dreading of the only closure, or 0 where nobody asks; and whether all equations
  // can be met.
  double side;
  bool exact;
};

// A row a pose: its rotation by columns, position, and turn about z.
inline constexpr int kPoseNumbers = 13;
// A row a closure: itself, its derivatives by the pose (six) and the joint that is read, and by the
// scalars.
inline constexpr int kClosureNumbers = 8;

// Whether Newton's method comes to a leg that is closed, on home's branch; `perhaps` where its last
// step is not short enough, which wants a closer look.
enum class Closed : char { no, perhaps, yes };

// From joints by themselves, a row a pose; from home where `starts` are null.
struct DeclaredKernels {
  // To these joints.
  void (*close)(const LaneLeg& leg, const double* poses, const double* starts, Index count,
                double* joints, Closed* closed);
  // To so many closures from the first on, with the read joint as given (NaN of no leg's), closed
  // or not; from starts on any branch.
  void (*closures)(const LaneLeg& leg, const double* poses, const double* read,
                   const double* starts, Index count, int first, int closures, double* rows,
                   Closed* closed);
  // From close by, closed: what the first closure gains by the joint that is read; NaN where
  // Newton's method does not come to rest.
  void (*slopes)(const LaneLeg& leg, const double* poses, const double* starts, Index count,
                 double* slopes);
};

// Those for this processor and so many poses; what a pose gets depends on nothing but that pose.
const DeclaredKernels& declared_kernels(Index count);

}  // namespace symkin::declared
