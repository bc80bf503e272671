// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/estimation/evaluation.hpp"

void bind_evaluation(py::module_& module) {
  using symkin::PoseErrors;
  py::class_<PoseErrors>(module, "PoseErrors")
      .def_readonly("differences", &PoseErrors::differences)
      .def_readonly("evaluated", &PoseErrors::evaluated)
      .def_readonly("failed", &PoseErrors::failed)
      .def_readonly("position_rms", &PoseErrors::position_rms)
      .def_readonly("position_max", &PoseErrors::position_max)
      .def_readonly("orientation_rms", &PoseErrors::orientation_rms)
      .def_readonly("orientation_max", &PoseErrors::orientation_max);
  module.def("command_errors", &symkin::command_errors, py::arg("actual"), py::arg("model"),
             py::arg("commanded"), ReleaseGil());
  module.def("measurement_errors", &symkin::measurement_errors, py::arg("model"),
             py::arg("measured"), py::arg("readings"), ReleaseGil());
}
