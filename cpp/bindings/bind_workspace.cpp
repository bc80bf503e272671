// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/kinematics/workspace.hpp"

void bind_workspace(py::module_& module) {
  using symkin::WorkspaceOptions;
  using symkin::WorkspaceRejections;
  using symkin::WorkspaceSample;

  py::class_<WorkspaceOptions> options(module, "WorkspaceOptions");
  options.def(py::init<>())
      .def_readwrite("reach_margin", &WorkspaceOptions::reach_margin)
      .def_readwrite("conditioning_limit", &WorkspaceOptions::conditioning_limit)
      .def_readwrite("characteristic_length", &WorkspaceOptions::characteristic_length)
      .def_readwrite("reading_lower", &WorkspaceOptions::reading_lower)
      .def_readwrite("reading_upper", &WorkspaceOptions::reading_upper);
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
