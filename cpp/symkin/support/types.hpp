// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace symkin {

inline constexpr double kPi = 3.141592653589793238463;

using Index = Eigen::Index;
using Vector = Eigen::VectorXd;

// One row a pose (or a candidate): the layout that crosses the Python boundary without a copy.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using ConstRows = Eigen::Ref<const RowMatrix>;
using Rows = Eigen::Ref<RowMatrix>;
using ConstVector = Eigen::Ref<const Vector>;

// All rows or columns. Version 5 has it among the placeholders, 3.4 warns of it there.
#if EIGEN_VERSION_AT_LEAST(3, 4, 90)
inline constexpr auto kAll = Eigen::placeholders::all;
#else
inline const auto kAll = Eigen::all;  // NOLINT(readability-identifier-naming)
#endif

}  // namespace symkin
