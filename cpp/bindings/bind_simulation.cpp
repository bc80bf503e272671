// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/estimation/simulation.hpp"
#include "symkin/support/error.hpp"

namespace {

void check_shape(const symkin::MeasurementSet& set) {
  const auto rows = set.poses.rows();
  const auto sets = static_cast<symkin::Index>(set.leg_sets.size());
  if (set.readings.rows() != rows || sets != rows) {
    throw symkin::InvalidInput("readings have " + std::to_string(set.readings.rows()) +
                               " rows and leg_sets " + std::to_string(sets) + "; expected " +
                               std::to_string(rows) + ", one a pose");
  }
  const auto legs = set.readings.cols();
  for (const symkin::Index leg : set.leg_sets) {
    if (leg < -1 || leg >= legs) {
      throw symkin::InvalidInput("leg_sets has leg " + std::to_string(leg) + "; expected 0 to " +
                                 std::to_string(legs - 1) + ", or -1 for all");
    }
  }
}

}  // namespace

void bind_simulation(py::module_& module) {
  using symkin::MeasurementSet;
  using symkin::PoseSet;
  using symkin::Simulation;

  py::class_<MeasurementSet>(module, "MeasurementSet")
      .def(py::init([](symkin::RowMatrix poses, symkin::RowMatrix readings,
                       std::vector<symkin::Index> leg_sets) {
             MeasurementSet set{std::move(poses), std::move(readings), std::move(leg_sets)};
             check_shape(set);
             return set;
           }),
           py::arg("poses"), py::arg("readings"), py::arg("leg_sets"))
      .def_readonly("poses", &MeasurementSet::poses)
      .def_readonly("readings", &MeasurementSet::readings)
      .def_readonly("leg_sets", &MeasurementSet::leg_sets);
  py::class_<PoseSet>(module, "PoseSet")
      .def(py::init([](symkin::Index leg, symkin::RowMatrix poses, symkin::Index wanted) {
             return PoseSet{leg, std::move(poses), wanted};
           }),
           py::arg("leg"), py::arg("poses"), py::arg("wanted"));
  py::class_<Simulation>(module, "Simulation")
      .def_readonly("measurements", &Simulation::measurements)
      .def_readonly("replaced", &Simulation::replaced);
  module.def("disturb", &symkin::disturb, py::arg("nominal"), py::arg("tolerances"),
             py::arg("seed"));
  module.def("simulate", &symkin::simulate, py::arg("actual"), py::arg("model"), py::arg("sets"),
             py::arg("noise"), py::arg("seed"), ReleaseGil());
}
