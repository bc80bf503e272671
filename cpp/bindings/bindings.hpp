// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace py = pybind11;

// One function a concept, in bind_<concept>.cpp. Arguments are named, arrays cross without copies
// where NumPy's are C-contiguous float64, and long computations let other Python threads run.
void bind_chains(py::module_& module);
void bind_mechanism(py::module_& module);
void bind_kinematics(py::module_& module);
void bind_symmetry(py::module_& module);
void bind_workspace(py::module_& module);
void bind_observability(py::module_& module);
void bind_selection(py::module_& module);
void bind_simulation(py::module_& module);
void bind_identification(py::module_& module);
void bind_diagnosis(py::module_& module);
void bind_evaluation(py::module_& module);

using ReleaseGil = py::call_guard<py::gil_scoped_release>;
