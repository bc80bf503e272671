// SPDX-License-Identifier: MIT
#include <algorithm>

#include "bindings.hpp"
#include "symkin/design/design.hpp"
#include "symkin/estimation/leg_rows.hpp"

namespace {

using Flags = Eigen::Array<bool, Eigen::Dynamic, 1>;

void bind_options(py::module_& module) {
  using symkin::design::Criterion;
  using symkin::design::SelectionMethod;
  using symkin::design::SelectionOptions;
  py::native_enum<SelectionMethod>(module, "SelectionMethod", "enum.Enum")
      .value("sun_hollerbach", SelectionMethod::sun_hollerbach)
      .value("exchange", SelectionMethod::exchange)
      .value("exhaustive", SelectionMethod::exhaustive)
      .value("random", SelectionMethod::random)
      .value("all", SelectionMethod::all)
      .finalize();
  py::native_enum<Criterion>(module, "Criterion", "enum.Enum")
      .value("O1", Criterion::O1)
      .value("O2", Criterion::O2)
      .value("O3", Criterion::O3)
      .value("O4", Criterion::O4)
      .value("O5", Criterion::O5)
      .value("expected_error", Criterion::expected_error)
      .finalize();
  py::class_<SelectionOptions> options(module, "SelectionOptions");
  options.def(py::init<>())
      .def_readwrite("count", &SelectionOptions::count)
      .def_readwrite("method", &SelectionOptions::method)
      .def_readwrite("criterion", &SelectionOptions::criterion)
      .def_readwrite("seed", &SelectionOptions::seed)
      .def_readwrite("restarts", &SelectionOptions::restarts)
      .def_readwrite("kicks", &SelectionOptions::kicks)
      .def_readwrite("required", &SelectionOptions::required)
      // An array: ten million flags in a list would take longer than the selection.
      .def_property(
          "forbidden",
          [](const SelectionOptions& self) {
            Flags flags(static_cast<Eigen::Index>(self.forbidden.size()));
            std::copy(self.forbidden.begin(), self.forbidden.end(), flags.begin());
            return flags;
          },
          [](SelectionOptions& self, const Eigen::Ref<const Flags>& flags) {
            self.forbidden.assign(flags.begin(), flags.end());
          })
      .def_readwrite("minimum_distance", &SelectionOptions::minimum_distance)
      .def_readwrite("time_limit_s", &SelectionOptions::time_limit_s)
      .def_readwrite("spare_count", &SelectionOptions::spare_count)
      .def_readwrite("threads", &SelectionOptions::threads)
      .def_readwrite("memory_limit_bytes", &SelectionOptions::memory_limit_bytes);
  def_array(options, "prior", &SelectionOptions::prior);
  def_array(options, "coordinates", &SelectionOptions::coordinates);
  def_array(options, "column_scale", &SelectionOptions::column_scale);
  def_array(options, "error_weight", &SelectionOptions::error_weight);
}

// The poses live as long as the rows; noconvert refuses poses that would be copied for the call
// only.
void bind_leg_rows(py::module_& module) {
  using symkin::LegRows;
  py::class_<LegRows>(module, "LegRows")
      .def(py::init([](const symkin::Mechanism& mechanism, symkin::Index leg,
                       const symkin::ConstRows& poses, symkin::RowKind kind,
                       const symkin::MeasurementNoise& noise,
                       std::vector<symkin::SymmetryPair> elements) {
             const symkin::RowsView view(poses.data(), poses.rows(), poses.cols(),
                                         Eigen::OuterStride<>(poses.outerStride()));
             return std::make_unique<LegRows>(mechanism, leg, view, kind, noise,
                                              symkin::Orbit{std::move(elements)});
           }),
           py::arg("mechanism"), py::arg("leg"), py::arg("poses").noconvert(), py::arg("kind"),
           py::arg("noise"), py::arg("elements"), py::keep_alive<1, 4>())
      .def_property_readonly("size", &LegRows::size)
      .def_property_readonly("rows_per_pose", &LegRows::rows_per_pose)
      .def_property_readonly("parameters", &LegRows::parameters);
}

}  // namespace

void bind_design(py::module_& module) {
  using symkin::design::Certificate;
  using symkin::design::Selection;
  bind_options(module);
  bind_leg_rows(module);
  py::class_<Certificate>(module, "Certificate")
      .def_readonly("log_det_bound_repeats", &Certificate::log_det_bound_repeats)
      .def_readonly("log_det_bound_distinct", &Certificate::log_det_bound_distinct)
      .def_readonly("efficiency_repeats", &Certificate::efficiency_repeats)
      .def_readonly("efficiency_distinct", &Certificate::efficiency_distinct)
      .def_readonly("criterion_bound", &Certificate::criterion_bound)
      .def_readonly("criterion_efficiency", &Certificate::criterion_efficiency)
      .def_readonly("proven_optimal", &Certificate::proven_optimal);
  py::class_<Selection>(module, "Selection")
      .def_readonly("indices", &Selection::indices)
      .def_readonly("log_det", &Selection::log_det)
      .def_readonly("criterion_value", &Selection::criterion_value)
      .def_readonly("certificate", &Selection::certificate)
      .def_readonly("spares", &Selection::spares)
      .def_readonly("nodes", &Selection::nodes);
  module.def(
      "select_poses",
      [](symkin::ConstRows rows, symkin::Index rows_per_pose,
         const symkin::design::SelectionOptions& options) {
        return symkin::design::select_poses(symkin::design::CandidateRows{rows, rows_per_pose},
                                            options);
      },
      py::arg("rows"), py::arg("rows_per_pose"), py::arg("options"), ReleaseGil());
  module.def(
      "select_poses",
      [](const symkin::LegRows& rows, const symkin::design::SelectionOptions& options) {
        return symkin::design::select_poses(rows, options);
      },
      py::arg("rows"), py::arg("options"), ReleaseGil());
}
