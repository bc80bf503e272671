// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/chains/registry.hpp"
#include "symkin/estimation/unknowns.hpp"
#include "symkin/kinematics/inverse_kinematics.hpp"
#include "symkin/model/mechanism.hpp"
#include "symkin/model/pose_space.hpp"
#include "symkin/support/error.hpp"

namespace {

void bind_chains(py::module_& module) {
  using symkin::ChainInfo;
  using symkin::End;
  using symkin::ParameterInfo;
  using symkin::ParameterKind;

  py::native_enum<End>(module, "End", "enum.Enum")
      .value("none", End::none)
      .value("base", End::base)
      .value("platform", End::platform)
      .finalize();

  py::native_enum<ParameterKind>(module, "ParameterKind", "enum.Enum")
      .value("length", ParameterKind::length)
      .value("arc", ParameterKind::arc)
      .value("eccentricity", ParameterKind::eccentricity)
      .value("pulley_radius", ParameterKind::pulley_radius)
      .value("radius", ParameterKind::radius)
      .value("azimuth", ParameterKind::azimuth)
      .value("polar_angle", ParameterKind::polar_angle)
      .value("height", ParameterKind::height)
      .value("direction_azimuth", ParameterKind::direction_azimuth)
      .value("direction_distance", ParameterKind::direction_distance)
      .value("guide_azimuth", ParameterKind::guide_azimuth)
      .value("guide_elevation", ParameterKind::guide_elevation)
      .value("guide_swing", ParameterKind::guide_swing)
      .value("axis_azimuth", ParameterKind::axis_azimuth)
      .value("axis_elevation", ParameterKind::axis_elevation)
      .value("axis_swing", ParameterKind::axis_swing)
      .value("coordinate", ParameterKind::coordinate)
      .value("mirrored_coordinate", ParameterKind::mirrored_coordinate)
      .value("small_turn", ParameterKind::small_turn)
      .value("mirrored_small_turn", ParameterKind::mirrored_small_turn)
      .value("written_turn", ParameterKind::written_turn)
      .value("mirrored_written_turn", ParameterKind::mirrored_written_turn)
      .value("frame_roll", ParameterKind::frame_roll)
      .value("frame_pitch", ParameterKind::frame_pitch)
      .value("frame_yaw", ParameterKind::frame_yaw)
      .value("handedness", ParameterKind::handedness)
      .value("gain", ParameterKind::gain)
      .value("offset", ParameterKind::offset)
      .value("curvature", ParameterKind::curvature)
      .value("absent", ParameterKind::absent)
      .finalize();

  py::class_<ParameterInfo>(module, "ParameterInfo")
      .def_property_readonly("name", [](const ParameterInfo& self) { return self.name; })
      .def_property_readonly("end", [](const ParameterInfo& self) { return self.role.end; })
      .def_property_readonly("kind", [](const ParameterInfo& self) { return self.role.kind; })
      .def_readonly("held", &ParameterInfo::held);

  py::class_<ChainInfo>(module, "ChainInfo")
      .def_property_readonly("name", [](const ChainInfo& self) { return self.name; })
      .def_property_readonly("pose_space",
                             [](const ChainInfo& self) { return to_string(self.pose_space); })
      .def_readonly("parameters", &ChainInfo::parameters)
      .def_property_readonly("reads_angle",
                             [](const ChainInfo& self) { return is_angle(self.active_joint); })
      .def("is_angular", &ChainInfo::is_angular, py::arg("parameter"))
      .def_readonly("closures", &ChainInfo::closures)
      .def_readonly("hangs", &ChainInfo::hangs)
      .def_readonly("read", &ChainInfo::read)
      .def_property_readonly("runs_as", [](const ChainInfo& self) { return self.runs_as; })
      .def_property_readonly("free_coordinates",
                             [](const ChainInfo& self) { return symkin::free_coordinates(self); })
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

symkin::Mechanism make_mechanism(const std::string& name, const std::vector<std::string>& chains,
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
  std::vector<const symkin::ChainModel*> models;
  models.reserve(chains.size());
  for (const std::string& chain : chains) {
    models.push_back(&symkin::leg_model(chain, symkin::platform_named(platform)));
  }
  return {name, models, legs};
}

void bind_mechanism(py::module_& module) {
  using symkin::Mechanism;
  py::class_<Mechanism>(module, "Mechanism")
      .def(py::init(&make_mechanism), py::arg("name"), py::arg("chains"), py::arg("platform"),
           py::arg("parameters"), py::arg("working_modes"))
      .def_property_readonly("name", &Mechanism::name)
      .def_property_readonly("chains",
                             [](const Mechanism& self) {
                               std::vector<symkin::ChainInfo> chains;
                               for (symkin::Index leg = 0; leg < self.leg_count(); ++leg) {
                                 chains.push_back(self.model(leg).info());
                               }
                               return chains;
                             })
      .def_property_readonly("pose_space",
                             [](const Mechanism& self) { return to_string(self.pose_space()); })
      .def_property_readonly("dof", &Mechanism::dof)
      .def_property_readonly("mobility", &Mechanism::mobility)
      .def_property_readonly("free_coordinates", &Mechanism::free_coordinates)
      .def_property_readonly("redundant", &Mechanism::redundant)
      .def_property_readonly("leg_count", &Mechanism::leg_count)
      .def_property_readonly("parameters", &Mechanism::parameters)
      .def_property_readonly("estimated_parameters",
                             [](const Mechanism& self) { return self.estimated_parameters(); })
      .def_property_readonly("growing_parameters",
                             [](const Mechanism& self) { return symkin::growing_parameters(self); })
      .def("with_parameters", &Mechanism::with_parameters, py::arg("parameters"))
      .def("counted_from", &symkin::counted_from, py::arg("home"))
      .def(
          "joint_centres",
          [](const Mechanism& self, symkin::Index leg, symkin::ConstVector pose, double reading) {
            symkin::check_poses(self, pose.transpose());
            return self.model(leg).joint_centres(self.leg(leg).parameters, pose, reading);
          },
          py::arg("leg"), py::arg("pose"), py::arg("reading"));
}

}  // namespace

void bind_model(py::module_& module) {
  bind_chains(module);
  bind_mechanism(module);
}
