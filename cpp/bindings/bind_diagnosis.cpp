// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/estimation/detail/statistics.hpp"
#include "symkin/estimation/diagnosis.hpp"

void bind_diagnosis(py::module_& module) {
  using symkin::Diagnosis;
  using symkin::ResidualTest;
  using symkin::Suspect;

  py::enum_<Suspect>(module, "Suspect")
      .value("sensor_curvature", Suspect::sensor_curvature)
      .value("sensor_eccentricity", Suspect::sensor_eccentricity)
      .value("geometry", Suspect::geometry)
      .value("order", Suspect::order)
      .value("legs", Suspect::legs)
      .value("estimators", Suspect::estimators);
  py::class_<ResidualTest>(module, "ResidualTest")
      .def_readonly("suspect", &ResidualTest::suspect)
      .def_readonly("leg", &ResidualTest::leg)
      .def_readonly("other", &ResidualTest::other)
      .def_readonly("statistic", &ResidualTest::statistic)
      .def_readonly("terms", &ResidualTest::terms)
      .def_readonly("spare", &ResidualTest::spare)
      .def_readonly("p_value", &ResidualTest::p_value)
      .def_readonly("size", &ResidualTest::size);
  py::class_<Diagnosis>(module, "Diagnosis")
      .def_readonly("tests", &Diagnosis::tests)
      .def_readonly("student", &Diagnosis::student)
      .def_readonly("student_p", &Diagnosis::student_p)
      .def_readonly("pose_p", &Diagnosis::pose_p)
      .def_readonly("chi_square", &Diagnosis::chi_square)
      .def_readonly("degrees_of_freedom", &Diagnosis::degrees_of_freedom);
  module.def("chi_square_tail", &symkin::chi_square_tail, py::arg("value"),
             py::arg("degrees_of_freedom"));
  module.def("diagnose", &symkin::diagnose, py::arg("estimate"), py::arg("measurements"),
             py::arg("noise"), py::arg("rejected"), py::arg("turning_sensor"), py::arg("alarm"),
             ReleaseGil());
}
