// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/jet.h>
#include <ceres/sized_cost_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "symkin/model/leg_model.hpp"

namespace symkin {

// Everything that a leg struct does not say itself: batches, derivatives by autodiff of its
// closure, the sensor's gain and offset, cost functions. A leg struct (see chains/rrr.hpp) gives
//   kGeometry, Pose<T>, Geometry<T>       sizes and types; a geometry is a tuple of lengths (T)
//                                         and angles (Azimuth<T>)
//   kActiveJoint, info()                  names and roles of the parameters, working mode
//   closure<T>(geometry, pose, q)         metres
//   root(geometry, pose, mode)            the closed-form root in q, NaN out of reach
//   reach_margin(geometry, pose)          metres inside the reach
//   joint_centres(geometry, pose, q)      for drawings
template <typename Leg>
struct SensedLeg {
  static constexpr int kGeometry = Leg::kGeometry;
  static constexpr int kParameters = kGeometry + 2;
  using Pose = typename Leg::template Pose<double>;
  static constexpr int kDof = Pose::kDof;
  using GeometryValues = typename Leg::template Geometry<double>;

  // Derivative directions: geometry, then the pose's tangent, then q.
  static constexpr int kDirections = kGeometry + kDof + 1;
  using FullJet = ceres::Jet<double, kDirections>;
  using FullGeometry = typename Leg::template Geometry<FullJet>;

  static GeometryValues geometry(const double* parameters) {
    return make_geometry<GeometryValues>([=](int i) { return parameters[i]; }, Indices());
  }

  static double active_joint(const double* parameters, double reading) {
    return parameters[kGeometry] * reading + parameters[kGeometry + 1];
  }

  // psi at the pose, NaN out of reach; an angle within half a turn of the sensor's zero.
  static double reading(const GeometryValues& geometry, const double* parameters, int mode,
                        const double* pose) {
    double travel = Leg::root(geometry, Pose::constant(pose), mode) - parameters[kGeometry + 1];
    if constexpr (is_angle(Leg::kActiveJoint)) {
      travel = wrap_angle(travel);
    }
    return travel / parameters[kGeometry];
  }

  static FullGeometry variable_geometry(const double* parameters) {
    return make_geometry<FullGeometry>([=](int i) { return FullJet(parameters[i], i); }, Indices());
  }

  template <typename T>
  static typename Leg::template Geometry<T> constant_geometry(const double* parameters) {
    return make_geometry<typename Leg::template Geometry<T>>(
        [=](int i) { return T(parameters[i]); }, Indices());
  }

  static FullJet full_closure(const FullGeometry& geometry, const double* pose, double q) {
    return Leg::closure(geometry, Leg::template Pose<FullJet>::variable(pose, kGeometry),
                        FullJet(q, kDirections - 1));
  }

  // dh/dparam from the autodiff result: q = k psi + gamma brings gain and offset in.
  static void parameter_derivatives(const FullJet& h, double reading, double* derivatives) {
    std::copy(h.v.data(), h.v.data() + kGeometry, derivatives);
    derivatives[kGeometry] = reading * h.v[kDirections - 1];
    derivatives[kGeometry + 1] = h.v[kDirections - 1];
  }

 private:
  using Indices = std::make_integer_sequence<int, kGeometry>;

  // Each element from its value: a length as it is, an azimuth with cosine and sine.
  template <typename Geometry, typename Value, int... kIndices>
  static Geometry make_geometry(const Value& value,
                                std::integer_sequence<int, kIndices...> /*indices*/) {
    return Geometry(std::tuple_element_t<kIndices, Geometry>(value(kIndices))...);
  }
};

// Residual h(parameters; pose, reading) of one measured pose, metres. Weights and losses wrap it.
template <typename Leg>
class ClosureCost final : public ceres::SizedCostFunction<1, SensedLeg<Leg>::kParameters> {
  using Sensed = SensedLeg<Leg>;

 public:
  ClosureCost(const double* pose, double reading) : reading_(reading) {
    std::copy(pose, pose + Sensed::Pose::kCoordinates, pose_.begin());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const values = parameters[0];
    const auto h = Sensed::full_closure(Sensed::variable_geometry(values), pose_.data(),
                                        Sensed::active_joint(values, reading_));
    residuals[0] = h.a;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Sensed::parameter_derivatives(h, reading_, jacobians[0]);
    }
    return true;
  }

 private:
  std::array<double, Sensed::Pose::kCoordinates> pose_;
  double reading_;
};

// Residual g(parameters; pose) - reading of one measured pose (Eq. 15), sensor units, angles
// compared by the shortest turn. Derivative by the implicit function theorem.
template <typename Leg>
class ReadingCost final : public ceres::SizedCostFunction<1, SensedLeg<Leg>::kParameters> {
  using Sensed = SensedLeg<Leg>;

 public:
  ReadingCost(int mode, const double* pose, double reading) : mode_(mode), reading_(reading) {
    std::copy(pose, pose + Sensed::Pose::kCoordinates, pose_.begin());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const double* const values = parameters[0];
    const double gain = values[Sensed::kGeometry];
    const double root = Sensed::reading(Sensed::geometry(values), values, mode_, pose_.data());
    double travel = gain * (root - reading_);
    if constexpr (is_angle(Leg::kActiveJoint)) {
      travel = wrap_angle(travel);
    }
    residuals[0] = travel / gain;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      // On the turn on which the sensor stands.
      const double reading = reading_ + residuals[0];
      const auto h = Sensed::full_closure(Sensed::variable_geometry(values), pose_.data(),
                                          Sensed::active_joint(values, reading));
      Sensed::parameter_derivatives(h, reading, jacobians[0]);
      const double by_reading = gain * h.v[Sensed::kDirections - 1];
      for (int i = 0; i < Sensed::kParameters; ++i) {
        jacobians[0][i] /= -by_reading;
      }
    }
    return std::isfinite(residuals[0]);
  }

 private:
  std::array<double, Sensed::Pose::kCoordinates> pose_;
  int mode_;
  double reading_;
};

// The batched loops are flattened, everything that they call inlined: the arithmetic of small
// autodiff scalars costs less than passing them through memory. With the checks of the sanitizers
// that would be too much for the compiler.
#ifdef __SANITIZE_ADDRESS__
#define SYMKIN_FLATTEN
#else
#define SYMKIN_FLATTEN [[gnu::flatten]]
#endif
template <typename Leg>
class LegModelOf final : public LegModel {
  using Sensed = SensedLeg<Leg>;
  using Pose = typename Sensed::Pose;
  using Costs = std::vector<std::unique_ptr<ceres::CostFunction>>;

 public:
  LegModelOf() : info_(Leg::info()) {}

  const ChainInfo& info() const override { return info_; }

  SYMKIN_FLATTEN void inverse_kinematics(ConstVector parameters, int working_mode, ConstRows poses,
                                         Eigen::Ref<Vector> readings) const override {
    const auto geometry = Sensed::geometry(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      readings[i] = Sensed::reading(geometry, parameters.data(), working_mode, poses.row(i).data());
    }
  }

  SYMKIN_FLATTEN void reach_margin(ConstVector parameters, ConstRows poses,
                                   Eigen::Ref<Vector> margins) const override {
    const auto geometry = Sensed::geometry(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      margins[i] = Leg::reach_margin(geometry, Pose::constant(poses.row(i).data()));
    }
  }

  SYMKIN_FLATTEN void closure(ConstVector parameters, ConstRows poses, ConstVector readings,
                              Eigen::Ref<Vector> values) const override {
    const auto geometry = Sensed::geometry(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      values[i] = Leg::closure(geometry, Pose::constant(poses.row(i).data()),
                               Sensed::active_joint(parameters.data(), readings[i]));
    }
  }

  SYMKIN_FLATTEN void linearise(ConstVector parameters, ConstRows poses, ConstVector readings,
                                ClosureRows& rows) const override {
    rows.resize(poses.rows(), Sensed::kParameters, Sensed::kDof);
    const auto geometry = Sensed::variable_geometry(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      const auto h = Sensed::full_closure(geometry, poses.row(i).data(),
                                          Sensed::active_joint(parameters.data(), readings[i]));
      rows.closure[i] = h.a;
      Sensed::parameter_derivatives(h, readings[i], rows.by_parameters.row(i).data());
      rows.by_pose.row(i) = h.v.template segment<Sensed::kDof>(Sensed::kGeometry);
      rows.by_reading[i] = parameters[Sensed::kGeometry] * h.v[Sensed::kDirections - 1];
    }
  }

  SYMKIN_FLATTEN void linearise_pose(ConstVector parameters, ConstRows poses, ConstVector readings,
                                     ClosureRows& rows) const override {
    using PoseJet = ceres::Jet<double, Sensed::kDof + 1>;
    rows.closure.resize(poses.rows());
    rows.by_pose.resize(poses.rows(), Sensed::kDof);
    rows.by_reading.resize(poses.rows());
    const auto geometry = Sensed::template constant_geometry<PoseJet>(parameters.data());
    for (Index i = 0; i < poses.rows(); ++i) {
      const PoseJet h =
          Leg::closure(geometry, Leg::template Pose<PoseJet>::variable(poses.row(i).data(), 0),
                       PoseJet(Sensed::active_joint(parameters.data(), readings[i]), Sensed::kDof));
      rows.closure[i] = h.a;
      rows.by_pose.row(i) = h.v.template head<Sensed::kDof>();
      rows.by_reading[i] = parameters[Sensed::kGeometry] * h.v[Sensed::kDof];
    }
  }

  Costs closure_costs(ConstRows poses, ConstVector readings) const override {
    Costs costs;
    for (Index i = 0; i < poses.rows(); ++i) {
      costs.push_back(std::make_unique<ClosureCost<Leg>>(poses.row(i).data(), readings[i]));
    }
    return costs;
  }

  Costs reading_costs(int working_mode, ConstRows poses, ConstVector readings) const override {
    Costs costs;
    for (Index i = 0; i < poses.rows(); ++i) {
      costs.push_back(
          std::make_unique<ReadingCost<Leg>>(working_mode, poses.row(i).data(), readings[i]));
    }
    return costs;
  }

  RowMatrix joint_centres(ConstVector parameters, ConstVector pose, double reading) const override {
    const auto joints =
        Leg::joint_centres(Sensed::geometry(parameters.data()), Pose::constant(pose.data()),
                           Sensed::active_joint(parameters.data(), reading));
    RowMatrix centres(static_cast<Index>(joints.size()), position_size(Pose::kSpace));
    for (std::size_t i = 0; i < joints.size(); ++i) {
      centres.row(static_cast<Index>(i)) = joints[i].transpose();
    }
    return centres;
  }

 private:
  ChainInfo info_;
};

#undef SYMKIN_FLATTEN

}  // namespace symkin
