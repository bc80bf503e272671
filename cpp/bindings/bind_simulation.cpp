// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/simulation.hpp"

void bind_simulation(py::module_& module) {
  using symkin::MeasurementSet;
  using symkin::PoseSet;
  using symkin::Simulation;

  py::class_<MeasurementSet>(module, "MeasurementSet")
      .def(py::init([](symkin::RowMatrix poses, symkin::RowMatrix readings,
                       std::vector<symkin::Index> leg_sets) {
             return MeasurementSet{std::move(poses), std::move(readings), std::move(leg_sets)};
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
