// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/kinematics/forward_kinematics.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"

void bind_kinematics(py::module_& module) {
  using symkin::ClosureRows;
  using symkin::ForwardKinematicsOptions;
  using symkin::ForwardKinematicsResult;
  using symkin::ForwardStatus;
  using symkin::SingularityMeasures;

  module.def("inverse_kinematics", &symkin::inverse_kinematics, py::arg("mechanism"),
             py::arg("poses"), ReleaseGil());
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
}
