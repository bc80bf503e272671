// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/estimation/identification.hpp"

void bind_identification(py::module_& module) {
  using symkin::Estimator;
  using symkin::GoodnessOfFit;
  using symkin::Identification;
  using symkin::IdentificationOptions;
  using symkin::LegIdentification;
  using symkin::PoseUse;
  using symkin::RobustLoss;

  py::enum_<Estimator>(module, "Estimator")
      .value("paper", Estimator::paper)
      .value("inverse", Estimator::inverse)
      .value("implicit", Estimator::implicit)
      .value("joint", Estimator::joint);
  py::enum_<PoseUse>(module, "PoseUse").value("all", PoseUse::all).value("own", PoseUse::own);
  py::enum_<RobustLoss::Kind>(module, "LossKind")
      .value("none", RobustLoss::Kind::none)
      .value("huber", RobustLoss::Kind::huber)
      .value("cauchy", RobustLoss::Kind::cauchy)
      .value("tukey", RobustLoss::Kind::tukey);

  py::class_<LegIdentification>(module, "LegIdentification")
      .def_readonly("rows", &LegIdentification::rows)
      .def_readonly("residuals", &LegIdentification::residuals)
      .def_readonly("standardised", &LegIdentification::standardised)
      .def_readonly("rejected", &LegIdentification::rejected)
      .def_readonly("converged", &LegIdentification::converged)
      .def_readonly("failure", &LegIdentification::failure)
      .def_readonly("iterations", &LegIdentification::iterations)
      .def_readonly("condition", &LegIdentification::condition);
  py::class_<GoodnessOfFit>(module, "GoodnessOfFit")
      .def_readonly("legs", &GoodnessOfFit::legs)
      .def_readonly("chi_square", &GoodnessOfFit::chi_square)
      .def_readonly("degrees_of_freedom", &GoodnessOfFit::degrees_of_freedom)
      .def_readonly("limit", &GoodnessOfFit::limit)
      .def_readonly("least", &GoodnessOfFit::least);
  py::class_<Identification>(module, "Identification")
      .def_readonly("parameters", &Identification::parameters)
      .def_readonly("covariance", &Identification::covariance)
      .def_readonly("legs", &Identification::legs)
      .def_readonly("goodness", &Identification::goodness)
      .def_readonly("converged", &Identification::converged)
      .def_readonly("residual_rms", &Identification::residual_rms)
      .def_readonly("residual_max", &Identification::residual_max);
  module.def(
      "identify",
      [](const symkin::Mechanism& mechanism, const symkin::MeasurementSet& measurements,
         Estimator estimator, PoseUse use, const symkin::MeasurementNoise& noise,
         RobustLoss::Kind loss, double loss_scale, int max_iterations) {
        const IdentificationOptions options{
            estimator, use, noise, {loss, loss_scale}, max_iterations};
        return symkin::identify(mechanism, measurements, options);
      },
      py::arg("mechanism"), py::arg("measurements"), py::arg("estimator"), py::arg("use"),
      py::arg("noise"), py::arg("loss"), py::arg("loss_scale"), py::arg("max_iterations"),
      ReleaseGil());
}
