// SPDX-License-Identifier: MIT
#include <variant>

#include "bindings.hpp"
#include "symkin/kinematics/constraint.hpp"
#include "symkin/kinematics/continuation.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/kinematics/workspace.hpp"

namespace {

void bind_kinematics_of_poses(py::module_& module) {
  using symkin::ClosureRows;
  using symkin::ForwardKinematicsOptions;
  using symkin::ForwardKinematicsResult;
  using symkin::ForwardStatus;
  using symkin::SingularityMeasures;

  module.def(
      "inverse_kinematics",
      py::overload_cast<const symkin::Mechanism&, symkin::ConstRows>(&symkin::inverse_kinematics),
      py::arg("mechanism"), py::arg("poses"), ReleaseGil());
  module.def("on_constraint", &symkin::on_constraint, py::arg("mechanism"), py::arg("poses"),
             ReleaseGil());
  module.def("reach_margin", &symkin::reach_margin, py::arg("mechanism"), py::arg("poses"),
             ReleaseGil());
  module.def("closure", &symkin::closure, py::arg("mechanism"), py::arg("leg"), py::arg("poses"),
             py::arg("readings"), ReleaseGil());
  module.def("parameter_jacobian", &symkin::parameter_jacobian, py::arg("mechanism"),
             py::arg("leg"), py::arg("poses"), ReleaseGil());
  module.def("pose_jacobian", &symkin::pose_jacobian, py::arg("mechanism"), py::arg("poses"),
             ReleaseGil());

  py::class_<ClosureRows>(module, "ClosureRows")
      .def_readonly("closure", &ClosureRows::closure)
      .def_readonly("by_parameters", &ClosureRows::by_parameters)
      .def_readonly("by_pose", &ClosureRows::by_pose)
      .def_readonly("by_reading", &ClosureRows::by_reading);
  module.def("linearise", &symkin::linearise, py::arg("mechanism"), py::arg("leg"),
             py::arg("poses"), py::arg("readings"), ReleaseGil());

  py::class_<SingularityMeasures>(module, "SingularityMeasures")
      .def_readonly("serial", &SingularityMeasures::serial)
      .def_readonly("parallel", &SingularityMeasures::parallel)
      .def_readonly("condition", &SingularityMeasures::condition);
  module.def("singularity_measures", &symkin::singularity_measures, py::arg("mechanism"),
             py::arg("poses"), py::arg("characteristic_length"), ReleaseGil());

  py::class_<ForwardKinematicsResult>(module, "ForwardKinematicsResult")
      .def_readonly("poses", &ForwardKinematicsResult::poses)
      .def_property_readonly("converged", [](const ForwardKinematicsResult& self) {
        Eigen::Array<bool, Eigen::Dynamic, 1> flags(self.poses.rows());
        for (symkin::Index i = 0; i < flags.size(); ++i) {
          flags[i] = self.status[static_cast<std::size_t>(i)] == ForwardStatus::converged;
        }
        return flags;
      });
  module.def(
      "forward_kinematics",
      [](const symkin::Mechanism& mechanism, symkin::ConstRows readings, symkin::ConstRows start,
         int max_iterations) {
        ForwardKinematicsOptions options;
        options.max_iterations = max_iterations;
        return symkin::forward_kinematics(mechanism, readings, start, options);
      },
      py::arg("mechanism"), py::arg("readings"), py::arg("start"), py::arg("max_iterations") = 50,
      ReleaseGil());
  module.def("open_coordinates", &symkin::open_coordinates, py::arg("mechanism"), py::arg("pose"));
  module.def("continued", &symkin::continued, py::arg("mechanism"), py::arg("readings"),
             py::arg("home"), py::arg("known"), ReleaseGil());
}

// One a leg, or a number for all legs.
void def_limits(py::class_<symkin::WorkspaceOptions>& options, const char* name,
                symkin::Vector symkin::WorkspaceOptions::*member) {
  using symkin::Vector;
  options.def_property(
      name, [member](const symkin::WorkspaceOptions& self) { return Vector(self.*member); },
      [member](symkin::WorkspaceOptions& self, const std::variant<double, Vector>& value) {
        const double* const all = std::get_if<double>(&value);
        self.*member = all != nullptr ? Vector::Constant(1, *all) : std::get<Vector>(value);
      });
}

void bind_workspace(py::module_& module) {
  using symkin::WorkspaceOptions;
  using symkin::WorkspaceRejections;
  using symkin::WorkspaceSample;

  py::class_<WorkspaceOptions> options(module, "WorkspaceOptions");
  options.def(py::init<>())
      .def_readwrite("reach_margin", &WorkspaceOptions::reach_margin)
      .def_readwrite("conditioning_limit", &WorkspaceOptions::conditioning_limit)
      .def_readwrite("characteristic_length", &WorkspaceOptions::characteristic_length);
  def_limits(options, "reading_lower", &WorkspaceOptions::reading_lower);
  def_limits(options, "reading_upper", &WorkspaceOptions::reading_upper);
  def_array(options, "lower", &WorkspaceOptions::lower);
  def_array(options, "upper", &WorkspaceOptions::upper);
  def_array(options, "home", &WorkspaceOptions::home);
  py::class_<WorkspaceRejections>(module, "WorkspaceRejections")
      .def_readonly("reach", &WorkspaceRejections::reach)
      .def_readonly("limits", &WorkspaceRejections::limits)
      .def_readonly("aspect", &WorkspaceRejections::aspect)
      .def_readonly("conditioning", &WorkspaceRejections::conditioning);
  py::class_<WorkspaceSample>(module, "WorkspaceSample")
      .def_readonly("poses", &WorkspaceSample::poses)
      .def_readonly("readings", &WorkspaceSample::readings)
      .def_readonly("conditions", &WorkspaceSample::conditions)
      .def_readonly("drawn", &WorkspaceSample::drawn)
      .def_readonly("rejections", &WorkspaceSample::rejections);
  module.def("sample_workspace", &symkin::sample_workspace, py::arg("mechanism"),
             py::arg("options"), py::arg("count"), py::arg("seed"), ReleaseGil());
  module.def("inside_workspace", &symkin::inside_workspace, py::arg("mechanism"),
             py::arg("options"), py::arg("poses"), ReleaseGil());
}

}  // namespace

void bind_kinematics(py::module_& module) {
  bind_kinematics_of_poses(module);
  bind_workspace(module);
}
