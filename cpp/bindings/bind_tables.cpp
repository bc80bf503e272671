// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>
#include <vector>

#include "bindings.hpp"
#include "symkin/support/csv_table.hpp"

namespace {

using symkin::CsvColumn;
using symkin::CsvTable;
using symkin::CsvWords;
using symkin::Index;

}  // namespace

void bind_tables(py::module_& module) {
  py::class_<CsvColumn>(module, "CsvColumn")
      .def_readonly("name", &CsvColumn::name)
      .def_readonly("numbers", &CsvColumn::numbers)
      .def_readonly("empty", &CsvColumn::empty)
      .def_readonly("text", &CsvColumn::text)
      .def_readonly("point", &CsvColumn::point)
      .def_readonly("comma", &CsvColumn::comma);
  py::class_<CsvWords>(module, "CsvWords")
      .def_readonly("codes", &CsvWords::codes)
      .def_readonly("distinct", &CsvWords::distinct);
  py::class_<CsvTable>(module, "CsvTable")
      .def(py::init([](const py::bytes& text, Index passed, bool last) {
             const std::string_view view(text);
             const py::gil_scoped_release release;
             return CsvTable(view, {passed, last});
           }),
           py::arg("text"), py::arg("passed") = 0, py::arg("last") = true, py::keep_alive<1, 2>())
      .def_property_readonly("header_size", &CsvTable::header_size)
      .def_property_readonly("header_lines", &CsvTable::header_lines)
      .def("start", &CsvTable::start, py::arg("row"))
      .def("last_run", &CsvTable::last_run, py::arg("column"))
      .def("keep", &CsvTable::keep, py::arg("rows"))
      .def_property_readonly("column_count",
                             [](const CsvTable& self) { return self.columns().size(); })
      .def(
          "column",
          [](const CsvTable& self, std::size_t column) -> const CsvColumn& {
            return self.columns().at(column);
          },
          py::arg("column"), py::return_value_policy::reference_internal)
      .def_property_readonly("lines",
                             [](const CsvTable& self) {
                               return Eigen::Map<const Eigen::Matrix<Index, Eigen::Dynamic, 1>>(
                                          self.lines().data(), self.row_count())
                                   .eval();
                             })
      .def_property_readonly("with_commas", &CsvTable::with_commas)
      .def("cell", &CsvTable::cell, py::arg("row"), py::arg("column"))
      .def("words", &CsvTable::words, py::arg("column"), ReleaseGil());
  module.def(
      "csv_number",
      [](std::string_view cell, bool with_commas) -> std::optional<std::pair<double, std::string>> {
        const auto number = symkin::csv_number(cell, with_commas);
        if (!number) {
          return std::nullopt;
        }
        return std::pair(number->value,
                         number->mark == 0 ? std::string() : std::string(1, number->mark));
      },
      py::arg("cell"), py::arg("with_commas"));
  module.def(
      "csv_cells",
      [](const Eigen::Ref<const symkin::Vector>& values) {
        std::vector<std::string> cells(static_cast<std::size_t>(values.size()));
        std::transform(values.begin(), values.end(), cells.begin(), symkin::csv_cell);
        return cells;
      },
      py::arg("values"));
}
