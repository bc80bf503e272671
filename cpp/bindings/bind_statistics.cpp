// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/statistics/statistics.hpp"

namespace {

using symkin::ConstRows;
using symkin::ConstVector;
using symkin::Index;
using symkin::QuadraticForm;
using symkin::Vector;

void bind_distributions(py::module_& module) {
  module.def("chi_square_tail", &symkin::chi_square_tail, py::arg("value"),
             py::arg("degrees_of_freedom"));
  module.def("f_tail", &symkin::f_tail, py::arg("value"), py::arg("numerator"),
             py::arg("denominator"));
  module.def("noncentral_chi_square", &symkin::noncentral_chi_square, py::arg("value"),
             py::arg("degrees_of_freedom"), py::arg("noncentrality"));
  module.def("student_limit", &symkin::student_limit, py::arg("probability"), py::arg("degrees"));
}

void bind_quadratic_form(py::module_& module) {
  py::class_<QuadraticForm>(module, "QuadraticForm")
      .def(py::init([](const Vector& weights) { return QuadraticForm(weights); }),
           py::arg("weights"))
      .def(py::init<const Vector&, const Vector&>(), py::arg("weights"), py::arg("degrees"))
      .def_static("of", &QuadraticForm::of, py::arg("mean_square"), py::arg("covariance"),
                  ReleaseGil())
      .def_property_readonly("weights", [](const QuadraticForm& self) { return self.weights(); })
      .def_property_readonly("mean", &QuadraticForm::mean)
      .def(
          "tail",
          [](const QuadraticForm& self, const Vector& values) {
            return Vector(values.unaryExpr([&](double value) { return self.tail(value); }));
          },
          py::arg("values"), ReleaseGil())
      .def("quantile", &QuadraticForm::quantile, py::arg("probability"),
           py::arg("noise_degrees") = symkin::kNoiseKnown, ReleaseGil());
  module.def("mixed_quantile", &symkin::mixed_quantile, py::arg("mean_square"),
             py::arg("covariances"), py::arg("probability"),
             py::arg("noise_degrees") = symkin::kNoiseKnown, ReleaseGil());
}

void bind_effects(py::module_& module) {
  module.def(
      "largest_errors",
      [](ConstRows effects, Index rows_per_pose, Index parts, ConstRows covariances,
         double probability, double noise_degrees, Index poses, Index draws) {
        return symkin::largest_errors(effects, rows_per_pose, parts, covariances,
                                      {probability, noise_degrees, poses, draws});
      },
      py::arg("effects"), py::arg("rows_per_pose"), py::arg("parts"), py::arg("covariances"),
      py::arg("probability"), py::arg("noise_degrees") = symkin::kNoiseKnown,
      py::arg("poses") = symkin::LargestErrorOptions().poses,
      py::arg("draws") = symkin::LargestErrorOptions().draws, ReleaseGil());
}

void bind_drawing(py::module_& module) {
  using symkin::DrawingConflict;
  using symkin::FleetTolerances;
  py::class_<DrawingConflict>(module, "DrawingConflict")
      .def_readonly("directions", &DrawingConflict::directions)
      .def_readonly("q", &DrawingConflict::q)
      .def_readonly("p_large", &DrawingConflict::p_large)
      .def_readonly("weighted", &DrawingConflict::weighted)
      .def_readonly("p_small", &DrawingConflict::p_small)
      .def_readonly("ratio", &DrawingConflict::ratio)
      .def_readonly("factor", &DrawingConflict::factor)
      .def_readonly("as_drawn", &DrawingConflict::as_drawn);
  module.def("drawing_conflict", &symkin::drawing_conflict, py::arg("change"),
             py::arg("covariance"), py::arg("deviations"), ReleaseGil());
  py::class_<FleetTolerances>(module, "FleetTolerances")
      .def_readonly("factors", &FleetTolerances::factors)
      .def_readonly("log_deviations", &FleetTolerances::log_deviations)
      .def_readonly("iterations", &FleetTolerances::iterations)
      .def_readonly("converged", &FleetTolerances::converged);
  module.def("fleet_tolerances", &symkin::fleet_tolerances, py::arg("information"),
             py::arg("scores"), py::arg("kinds"), ReleaseGil());
}

}  // namespace

void bind_statistics(py::module_& module) {
  bind_distributions(module);
  bind_quadratic_form(module);
  bind_effects(module);
  bind_drawing(module);
}
