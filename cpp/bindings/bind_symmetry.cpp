// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/chains/registry.hpp"
#include "symkin/symmetry/action.hpp"
#include "symkin/symmetry/carrying.hpp"
#include "symkin/symmetry/detection.hpp"
#include "symkin/symmetry/generation.hpp"
#include "symkin/symmetry/group.hpp"
#include "symkin/symmetry/pairs.hpp"
#include "symkin/symmetry/verification.hpp"
#include "symkin/symmetry/workspace_symmetry.hpp"

namespace {

using symkin::SymmetryElement;
using symkin::SymmetryFrame;
using symkin::SymmetryGroup;

void bind_group(py::module_& module) {
  py::class_<SymmetryElement>(module, "SymmetryElement")
      .def(py::init<int, bool>(), py::arg("rotation"), py::arg("reflection"))
      .def_readonly("rotation", &SymmetryElement::rotation)
      .def_readonly("reflection", &SymmetryElement::reflection)
      .def_property_readonly("label",
                             [](const SymmetryElement& self) { return SymmetryGroup::label(self); })
      .def("__eq__",
           [](const SymmetryElement& self, const py::object& other) {
             return py::isinstance<SymmetryElement>(other) && self == other.cast<SymmetryElement>();
           })
      .def("__hash__",
           [](const SymmetryElement& self) {
             return py::hash(py::make_tuple(self.rotation, self.reflection));
           })
      .def("__repr__", [](const SymmetryElement& self) { return SymmetryGroup::label(self); });

  py::class_<SymmetryFrame>(module, "SymmetryFrame")
      .def_readonly("base_centre", &SymmetryFrame::base_centre)
      .def_readonly("platform_centre", &SymmetryFrame::platform_centre)
      .def_readonly("base_axis", &SymmetryFrame::base_axis)
      .def_readonly("platform_axis", &SymmetryFrame::platform_axis);

  py::class_<SymmetryGroup>(module, "SymmetryGroup")
      .def(py::init(&SymmetryGroup::named), py::arg("name"), py::arg("axis") = 0.0)
      .def_property_readonly("rotations", &SymmetryGroup::rotations)
      .def_property_readonly("frame", &SymmetryGroup::frame)
      .def_property_readonly("dihedral", &SymmetryGroup::dihedral)
      .def_property_readonly("size", &SymmetryGroup::size)
      .def_property_readonly("name", &SymmetryGroup::name)
      .def_property_readonly("paper_name", &SymmetryGroup::paper_name)
      .def_property_readonly("elements", &SymmetryGroup::elements)
      .def("compose", &SymmetryGroup::compose, py::arg("outer"), py::arg("inner"))
      .def("inverse", &SymmetryGroup::inverse, py::arg("element"))
      .def("parse", &SymmetryGroup::parse, py::arg("label"))
      .def("angle", &SymmetryGroup::angle, py::arg("element"));
}

// The parameters (legs x p) and working modes of the generated legs.
std::pair<symkin::RowMatrix, std::vector<int>> generate_legs(
    const SymmetryGroup& group, const std::string& chain, const std::string& platform,
    symkin::ConstVector parameters, int working_mode,
    const std::vector<SymmetryElement>& elements) {
  const symkin::LegModel& model = symkin::leg_model(chain, symkin::platform_named(platform));
  const auto legs = symkin::generate_legs(group, model, {parameters, working_mode}, elements);
  symkin::RowMatrix values(static_cast<symkin::Index>(legs.size()), parameters.size());
  std::vector<int> modes;
  for (std::size_t i = 0; i < legs.size(); ++i) {
    values.row(static_cast<symkin::Index>(i)) = legs[i].parameters.transpose();
    modes.push_back(legs[i].working_mode);
  }
  return {std::move(values), std::move(modes)};
}

void bind_detection(py::module_& module) {
  using symkin::Carrier;
  using symkin::DetectedSymmetry;
  using symkin::SymmetryTolerance;
  py::class_<DetectedSymmetry>(module, "DetectedSymmetry")
      .def_readonly("structure", &DetectedSymmetry::structure)
      .def_readonly("with_modes", &DetectedSymmetry::with_modes)
      .def_readonly("images", &DetectedSymmetry::images);
  py::class_<Carrier>(module, "Carrier")
      .def_readonly("reference", &Carrier::reference)
      .def_readonly("element", &Carrier::element);
  module.def("detect_symmetry", &symkin::detect_symmetry, py::arg("mechanism"),
             py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"));
  module.def("symmetry_deviations", &symkin::symmetry_deviations, py::arg("mechanism"),
             py::arg("group"), py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"));
  using symkin::WorkspaceSymmetry;
  py::class_<WorkspaceSymmetry>(module, "WorkspaceSymmetry")
      .def_readonly("element", &WorkspaceSymmetry::element)
      .def_readonly("tested", &WorkspaceSymmetry::tested)
      .def_readonly("inside", &WorkspaceSymmetry::inside)
      .def_readonly("mismatches", &WorkspaceSymmetry::mismatches)
      .def_readonly("unreachable", &WorkspaceSymmetry::unreachable)
      .def_readonly("reading_deviation", &WorkspaceSymmetry::reading_deviation)
      .def_readonly("keeps_modes", &WorkspaceSymmetry::keeps_modes);
  module.def("verify_workspace_symmetry", &symkin::verify_workspace_symmetry, py::arg("mechanism"),
             py::arg("options"), py::arg("group"), py::arg("elements"), py::arg("count"),
             py::arg("seed"), py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"),
             ReleaseGil());
  module.def("leg_carriers", &symkin::leg_carriers, py::arg("mechanism"), py::arg("group"),
             py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"));
}

void bind_verification(py::module_& module) {
  using symkin::ElementImage;
  using symkin::LegDeviation;
  using symkin::SymmetryTolerance;
  py::class_<SymmetryTolerance>(module, "SymmetryTolerance")
      .def(py::init([](double length, double angle, double gain) {
             const SymmetryTolerance tolerance{length, angle, gain};
             tolerance.check();
             return tolerance;
           }),
           py::arg("length") = 1e-6, py::arg("angle") = 1e-6, py::arg("gain") = 1e-6)
      .def_readonly("length", &SymmetryTolerance::length)
      .def_readonly("angle", &SymmetryTolerance::angle)
      .def_readonly("gain", &SymmetryTolerance::gain);
  py::class_<LegDeviation>(module, "LegDeviation")
      .def_readonly("leg", &LegDeviation::leg)
      .def_readonly("nearest", &LegDeviation::nearest)
      .def_readonly("parameter", &LegDeviation::parameter)
      .def_readonly("deviation", &LegDeviation::deviation)
      .def_readonly("in_tolerances", &LegDeviation::in_tolerances);
  py::class_<ElementImage>(module, "ElementImage")
      .def_readonly("element", &ElementImage::element)
      .def_readonly("permutation", &ElementImage::permutation)
      .def_readonly("deviations", &ElementImage::deviations)
      .def_readonly("keeps_structure", &ElementImage::keeps_structure)
      .def_readonly("keeps_modes", &ElementImage::keeps_modes);
  module.attr("IMAGE_TOLERANCES") = symkin::kImageTolerances;
  module.def("image_of_legs", &symkin::image_of_legs, py::arg("mechanism"), py::arg("group"),
             py::arg("element"),
             py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"));
  module.def("verify_symmetry", &symkin::verify_symmetry, py::arg("mechanism"), py::arg("group"),
             py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"));
  module.def("observability_group", &symkin::observability_group, py::arg("mechanism"),
             py::arg("group"), py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"));
}

void bind_pairs(py::module_& module) {
  using symkin::FoundPair;
  using symkin::Isometry;
  using symkin::JointMap;
  using symkin::PairSymmetry;
  using symkin::SymmetryPair;
  using symkin::SymmetryTolerance;
  py::class_<Isometry>(module, "Isometry")
      .def(py::init<Eigen::Matrix3d, Eigen::Vector3d>(), py::arg("linear"), py::arg("shift"))
      .def_readonly("linear", &Isometry::linear)
      .def_readonly("shift", &Isometry::shift);
  py::class_<SymmetryPair>(module, "SymmetryPair")
      .def(py::init<Isometry, Isometry, bool>(), py::arg("base"), py::arg("platform"),
           py::arg("exchange"))
      .def_readonly("base", &SymmetryPair::base)
      .def_readonly("platform", &SymmetryPair::platform)
      .def_readonly("exchange", &SymmetryPair::exchange)
      .def_property_readonly("improper", &SymmetryPair::improper)
      .def(
          "compose",
          [](const SymmetryPair& self, const SymmetryPair& inner) {
            return symkin::compose(self, inner);
          },
          py::arg("inner"))
      .def("inverse", [](const SymmetryPair& self) { return symkin::inverse(self); })
      .def(
          "transform_poses",
          [](const SymmetryPair& self, const symkin::Mechanism& mechanism,
             symkin::ConstRows poses) {
            return symkin::transform_poses(self, mechanism.pose_space(), poses);
          },
          py::arg("mechanism"), py::arg("poses"));
  py::class_<JointMap>(module, "JointMap")
      .def_readonly("sign", &JointMap::sign)
      .def_readonly("mode_factor", &JointMap::mode_factor)
      .def_readonly("constant", &JointMap::constant);
  py::class_<FoundPair>(module, "FoundPair")
      .def_readonly("pair", &FoundPair::pair)
      .def_readonly("permutation", &FoundPair::permutation)
      .def_readonly("joints", &FoundPair::joints)
      .def_readonly("in_tolerances", &FoundPair::in_tolerances)
      .def_readonly("keeps_modes", &FoundPair::keeps_modes)
      .def_readonly("permutes_readings", &FoundPair::permutes_readings);
  py::class_<PairSymmetry>(module, "PairSymmetry")
      .def_readonly("pairs", &PairSymmetry::pairs)
      .def_readonly("continuous_base", &PairSymmetry::continuous_base)
      .def_readonly("continuous_platform", &PairSymmetry::continuous_platform);
  module.def("apart", &symkin::apart, py::arg("a"), py::arg("b"), py::arg("size") = 1.0);
  module.def(
      "carried_leg",
      [](const symkin::Mechanism& mechanism, symkin::Index leg, const SymmetryPair& pair,
         symkin::Index like) {
        const symkin::ChainInfo& chain = mechanism.model(leg).info();
        symkin::Leg image =
            symkin::carried_leg(chain, mechanism.leg(leg), pair, mechanism.leg(like));
        return std::pair(std::move(image.parameters), image.working_mode);
      },
      py::arg("mechanism"), py::arg("leg"), py::arg("pair"), py::arg("like"));
  module.def(
      "carried_derivatives",
      [](const symkin::Mechanism& mechanism, symkin::Index leg, const SymmetryPair& pair,
         symkin::Index like) {
        return symkin::carried_derivatives(mechanism.model(leg).info(), mechanism.leg(leg), pair,
                                           mechanism.leg(like));
      },
      py::arg("mechanism"), py::arg("leg"), py::arg("pair"), py::arg("like"));
  module.def("pair_of", &symkin::pair_of, py::arg("group"), py::arg("element"));
  module.def("find_pairs", &symkin::find_pairs, py::arg("mechanism"), py::arg("home"),
             py::arg_v("tolerance", SymmetryTolerance{}, "SymmetryTolerance()"));
}

}  // namespace

void bind_symmetry(py::module_& module) {
  bind_group(module);
  module.def(
      "transform_poses",
      [](const SymmetryGroup& group, SymmetryElement element, const symkin::Mechanism& mechanism,
         symkin::ConstRows poses) {
        return symkin::transform_poses(group, element, mechanism.pose_space(), poses);
      },
      py::arg("group"), py::arg("element"), py::arg("mechanism"), py::arg("poses"));
  module.def(
      "reading_sign",
      [](SymmetryElement element, const symkin::Mechanism& mechanism, symkin::Index leg) {
        return symkin::reading_sign(element, mechanism.model(leg).info().active_joint);
      },
      py::arg("element"), py::arg("mechanism"), py::arg("leg") = 0);
  module.def("generating_elements", &symkin::generating_elements, py::arg("group"),
             py::arg("count"));
  module.def("generate_legs", &generate_legs, py::arg("group"), py::arg("chain"),
             py::arg("platform"), py::arg("parameters"), py::arg("working_mode"),
             py::arg("elements"));
  bind_verification(module);
  bind_detection(module);
  bind_pairs(module);
}
