// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace py = pybind11;

// One function a room, in bind_<room>.cpp. Arguments are named, arrays cross without copies where
// NumPy's are C-contiguous float64, and long computations let other Python threads run.
void bind_model(py::module_& module);
void bind_declared(py::module_& module);
void bind_kinematics(py::module_& module);
void bind_symmetry(py::module_& module);
void bind_statistics(py::module_& module);
void bind_tables(py::module_& module);
void bind_estimation(py::module_& module);
void bind_design(py::module_& module);

// An array that is read as a copy: a view of it would dangle once the member is set anew.
template <typename Class, typename Array>
void def_array(py::class_<Class>& type, const char* name, Array Class::*member) {
  type.def_property(
      name, [member](const Class& self) { return Array(self.*member); },
      [member](Class& self, Array value) { self.*member = std::move(value); });
}

using ReleaseGil = py::call_guard<py::gil_scoped_release>;
