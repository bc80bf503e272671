// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/chains/registry.hpp"
#include "symkin/model/mechanism.hpp"
#include "symkin/support/error.hpp"

namespace {

symkin::Mechanism make_mechanism(std::string name, const std::string& chain,
                                 const std::string& platform, symkin::ConstRows parameters,
                                 const std::vector<int>& working_modes) {
  const auto count = static_cast<symkin::Index>(working_modes.size());
  if (parameters.rows() != count) {
    throw symkin::InvalidInput("parameters have " + std::to_string(parameters.rows()) +
                               " rows; expected " + std::to_string(count) + ", one a working mode");
  }
  std::vector<symkin::Leg> legs;
  for (std::size_t i = 0; i < working_modes.size(); ++i) {
    legs.push_back({parameters.row(static_cast<symkin::Index>(i)).transpose(), working_modes[i]});
  }
  return {std::move(name), symkin::leg_model(chain, symkin::platform_named(platform)),
          std::move(legs)};
}

}  // namespace

void bind_mechanism(py::module_& module) {
  using symkin::Mechanism;
  py::class_<Mechanism>(module, "Mechanism")
      .def(py::init(&make_mechanism), py::arg("name"), py::arg("chain"), py::arg("platform"),
           py::arg("parameters"), py::arg("working_modes"))
      .def_property_readonly("name", &Mechanism::name)
      .def_property_readonly("chain", [](const Mechanism& self) { return self.model().info(); })
      .def_property_readonly("pose_space",
                             [](const Mechanism& self) { return to_string(self.pose_space()); })
      .def_property_readonly("dof", &Mechanism::dof)
      .def_property_readonly("leg_count", &Mechanism::leg_count)
      .def_property_readonly("parameters", &Mechanism::parameters)
      .def("with_parameters", &Mechanism::with_parameters, py::arg("parameters"))
      .def(
          "joint_centres",
          [](const Mechanism& self, symkin::Index leg, symkin::ConstVector pose, double reading) {
            symkin::check_poses(self, pose.transpose());
            return self.model().joint_centres(self.leg(leg).parameters, pose, reading);
          },
          py::arg("leg"), py::arg("pose"), py::arg("reading"));
}
