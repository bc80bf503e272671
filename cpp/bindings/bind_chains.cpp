// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/chains/registry.hpp"
#include "symkin/model/pose_space.hpp"

void bind_chains(py::module_& module) {
  using symkin::ActiveJoint;
  using symkin::ChainInfo;
  using symkin::End;
  using symkin::ParameterInfo;
  using symkin::ParameterKind;

  py::enum_<End>(module, "End")
      .value("none", End::none)
      .value("base", End::base)
      .value("platform", End::platform);

  py::enum_<ParameterKind>(module, "ParameterKind")
      .value("length", ParameterKind::length)
      .value("eccentricity", ParameterKind::eccentricity)
      .value("radius", ParameterKind::radius)
      .value("azimuth", ParameterKind::azimuth)
      .value("polar_angle", ParameterKind::polar_angle)
      .value("direction_azimuth", ParameterKind::direction_azimuth)
      .value("direction_distance", ParameterKind::direction_distance)
      .value("gain", ParameterKind::gain)
      .value("offset", ParameterKind::offset);

  py::enum_<ActiveJoint>(module, "ActiveJoint")
      .value("angle_in_base", ActiveJoint::angle_in_base)
      .value("angle_in_platform", ActiveJoint::angle_in_platform)
      .value("elbow_angle", ActiveJoint::elbow_angle)
      .value("travel_on_base", ActiveJoint::travel_on_base)
      .value("travel_on_platform", ActiveJoint::travel_on_platform)
      .value("distance", ActiveJoint::distance);

  py::class_<ParameterInfo>(module, "ParameterInfo")
      .def_property_readonly("name", [](const ParameterInfo& self) { return self.name; })
      .def_property_readonly("end", [](const ParameterInfo& self) { return self.role.end; })
      .def_property_readonly("kind", [](const ParameterInfo& self) { return self.role.kind; });

  py::class_<ChainInfo>(module, "ChainInfo")
      .def_property_readonly("name", [](const ChainInfo& self) { return self.name; })
      .def_property_readonly("pose_space",
                             [](const ChainInfo& self) { return to_string(self.pose_space); })
      .def_readonly("parameters", &ChainInfo::parameters)
      .def_readonly("active_joint", &ChainInfo::active_joint)
      .def_property_readonly("reads_angle",
                             [](const ChainInfo& self) { return is_angle(self.active_joint); })
      .def("is_angular", &ChainInfo::is_angular, py::arg("parameter"))
      .def_readonly("closures", &ChainInfo::closures)
      .def_readonly("mode_is_orientation", &ChainInfo::mode_is_orientation)
      .def_property_readonly("working_mode",
                             [](const ChainInfo& self) { return self.working_mode; });

  module.def(
      "chain_info",
      [](const std::string& chain, const std::string& platform) {
        return symkin::leg_model(chain, symkin::platform_named(platform)).info();
      },
      py::arg("chain"), py::arg("platform"));
  module.def(
      "chain_names",
      [](const std::string& platform) {
        return symkin::chain_names(symkin::platform_named(platform));
      },
      py::arg("platform"));
}
