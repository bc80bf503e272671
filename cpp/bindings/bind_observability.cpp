// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/estimation/accuracy.hpp"
#include "symkin/estimation/observability.hpp"

void bind_observability(py::module_& module) {
  using symkin::AccuracyWeights;
  using symkin::MeasurementNoise;
  using symkin::Observability;
  using symkin::RowKind;
  using symkin::Tolerances;

  py::class_<MeasurementNoise>(module, "MeasurementNoise")
      .def(py::init([](double position, double orientation, double reading) {
             const MeasurementNoise noise{position, orientation, reading};
             noise.check();
             return noise;
           }),
           py::arg("position"), py::arg("orientation"), py::arg("reading"));
  py::class_<Tolerances>(module, "Tolerances")
      .def(py::init([](double length, double angle, double gain) {
             const Tolerances tolerances{length, angle, gain};
             tolerances.check();
             return tolerances;
           }),
           py::arg("length"), py::arg("angle"), py::arg("gain"))
      .def(
          "deviations",
          [](const Tolerances& self, const symkin::Mechanism& mechanism, symkin::Index leg) {
            return self.deviations(mechanism.model().info(), mechanism.leg(leg).parameters);
          },
          py::arg("mechanism"), py::arg("leg"));

  py::enum_<RowKind>(module, "RowKind")
      .value("paper", RowKind::paper)
      .value("noise_aware", RowKind::noise_aware);
  module.def("observability_rows", &symkin::observability_rows, py::arg("mechanism"),
             py::arg("leg"), py::arg("poses"), py::arg("kind"), py::arg("noise"), ReleaseGil());
  module.def("mechanism_rows", &symkin::mechanism_rows, py::arg("mechanism"), py::arg("poses"),
             py::arg("kind"), py::arg("noise"), ReleaseGil());
  py::class_<Observability>(module, "Observability")
      .def_readonly("r_diagonal", &Observability::r_diagonal)
      .def_readonly("indices", &Observability::indices)
      .def_readonly("singular_values", &Observability::singular_values)
      .def_readonly("condition", &Observability::condition)
      .def_readonly("rank", &Observability::rank)
      .def_readonly("null_directions", &Observability::null_directions);
  module.def("analyse_observability", &symkin::analyse_observability, py::arg("rows"),
             py::arg("scale"), ReleaseGil());

  py::class_<AccuracyWeights>(module, "AccuracyWeights")
      .def_readonly("position", &AccuracyWeights::position)
      .def_readonly("orientation", &AccuracyWeights::orientation)
      .def_readonly("evaluated", &AccuracyWeights::evaluated)
      .def_readonly("failed", &AccuracyWeights::failed);
  module.def("accuracy_weights", &symkin::accuracy_weights, py::arg("mechanism"), py::arg("poses"),
             ReleaseGil());
  module.def(
      "expected_accuracy",
      [](const AccuracyWeights& weights, symkin::ConstRows covariance) {
        const auto accuracy = symkin::expected_accuracy(weights, covariance);
        return std::make_pair(accuracy.position, accuracy.orientation);
      },
      py::arg("weights"), py::arg("covariance"));
}
