// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "bindings.hpp"
#include "symkin/chains/declared/assembly.hpp"
#include "symkin/chains/registry.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/support/error.hpp"

namespace {

using symkin::declared::Compares;
using symkin::declared::Declaration;
using symkin::declared::Joint;
using symkin::declared::JointKind;
using symkin::declared::Scalar;
using symkin::declared::Slot;
using symkin::declared::Step;

// As Python has them, in the order of the structs.
using Joints =
    std::vector<std::tuple<std::string, std::array<double, 3>, bool, int, double, double>>;
using Transforms = std::vector<symkin::declared::TransformValues>;
using Steps = std::vector<std::tuple<std::string, int>>;
using Loops = std::vector<std::tuple<Steps, Steps, std::string, int, int>>;
using Uses = std::vector<std::tuple<std::string, int, int, double>>;
using Scalars =
    std::vector<std::tuple<std::string, int, int, symkin::End, symkin::ParameterKind, bool, Uses>>;

template <typename Value>
Value named(const std::map<std::string, Value>& values, const std::string& name) {
  const auto found = values.find(name);
  if (found == values.end()) {
    throw symkin::InvalidInput("unknown part \"" + name + "\" of a declared leg");
  }
  return found->second;
}

Step step_of(const std::string& kind, int index) {
  static const std::map<std::string, Step::Kind> kinds = {{"transform", Step::Kind::transform},
                                                          {"joint", Step::Kind::joint},
                                                          {"pose", Step::Kind::pose}};
  return {named(kinds, kind), index};
}

std::vector<Step> steps_of(const Steps& given) {
  std::vector<Step> steps;
  for (const auto& [kind, index] : given) {
    steps.push_back(step_of(kind, index));
  }
  return steps;
}

symkin::PoseSpace space_named(const std::string& name) {
  using symkin::PoseSpace;
  for (const PoseSpace space :
       {PoseSpace::planar, PoseSpace::point, PoseSpace::spatial, PoseSpace::translating,
        PoseSpace::spherical, PoseSpace::schoenflies}) {
    if (to_string(space) == name) {
      return space;
    }
  }
  throw symkin::InvalidInput("unknown pose space \"" + name + "\"");
}

Declaration make_declaration(const std::string& name, const std::string& space,
                             const Joints& joints, const Transforms& transforms, const Loops& loops,
                             const Scalars& scalars, const symkin::Vector& home_pose,
                             const symkin::Vector& home_joints,
                             const std::vector<symkin::Index>& free, bool recognise, int closure) {
  static const std::map<std::string, JointKind> kinds = {{"R", JointKind::turn},
                                                         {"P", JointKind::slide}};
  static const std::map<std::string, Compares> comparisons = {
      {"pose", Compares::pose},
      {"point", Compares::point},
      {"rotation", Compares::rotation},
      {"planar pose", Compares::planar_pose},
      {"planar point", Compares::planar_point},
      {"distance", Compares::distance}};
  const symkin::PoseSpace of = space_named(space);
  const auto own = std::count_if(joints.begin(), joints.end(), [](const auto& joint) {
    return std::get<3>(joint) == Joint::kOwn;
  });
  if (home_pose.size() != symkin::coordinate_count(of) || home_joints.size() != own) {
    throw symkin::InvalidInput("a home of " + std::to_string(home_pose.size()) +
                               " coordinates and " + std::to_string(home_joints.size()) +
                               " joints; expected " + std::to_string(symkin::coordinate_count(of)) +
                               " and " + std::to_string(own));
  }
  Declaration made{name, of, {}, home_pose, home_joints, free, recognise, closure};
  for (const auto& [kind, axis, read, follows, ratio, offset] : joints) {
    made.leg.joints.push_back(
        {named(kinds, kind), Eigen::Vector3d(axis.data()), read, follows, ratio, offset});
  }
  made.leg.transforms = transforms;
  for (const auto& [left, right, compares, length_transform, length_joint] : loops) {
    made.leg.loops.push_back({steps_of(left), steps_of(right), named(comparisons, compares),
                              length_transform, length_joint});
  }
  for (const auto& [scalar, transform, slot, end, kind, held, uses] : scalars) {
    made.leg.scalars.push_back({scalar, transform, static_cast<Slot>(slot), {end, kind}, held, {}});
    for (const auto& [at, index, of, factor] : uses) {
      made.leg.scalars.back().uses.push_back({step_of(at, index), static_cast<Slot>(of), factor});
    }
  }
  return made;
}

}  // namespace

void bind_declared(py::module_& module) {
  py::class_<Declaration>(module, "Declaration")
      .def(py::init(&make_declaration), py::arg("name"), py::arg("pose_space"), py::arg("joints"),
           py::arg("transforms"), py::arg("loops"), py::arg("scalars"), py::arg("home_pose"),
           py::arg("home_joints"), py::arg("free"), py::arg("recognise"), py::arg("closure"));
  module.def(
      "binding_closures",
      [](const Declaration& declaration, bool passive) {
        return symkin::declared::binding_closures(
            declaration.leg,
            {symkin::declared::pose_of(declaration.pose_space, declaration.home_pose.data()),
             declaration.home_joints},
            passive);
      },
      py::arg("declaration"), py::arg("passive") = false);
  module.def(
      "joints_at_home",
      [](const Declaration& declaration, const std::vector<bool>& known) {
        const symkin::declared::Pose pose =
            symkin::declared::pose_of(declaration.pose_space, declaration.home_pose.data());
        return symkin::declared::joints_at_home(declaration.leg, pose, declaration.home_joints,
                                                known);
      },
      py::arg("declaration"), py::arg("known"));
  module.def("joints_at", &symkin::declared::joints_at, py::arg("declaration"),
             py::arg("parameters"), py::arg("poses"));
  module.def("redundant_scalars", &symkin::declared::redundant_scalars, py::arg("readings"));
  module.def(
      "declare_chain", [](const Declaration& declaration) { symkin::declare_chain(declaration); },
      py::arg("declaration"));
}
