// SPDX-License-Identifier: MIT
#include "bindings.hpp"
#include "symkin/model/impossible_leg.hpp"
#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"
#include "symkin/support/not_identifiable.hpp"

namespace {

// Ctrl-C reaches long computations, as the exception that Python's handler of the signal raises.
void raise_signals() {
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) {
    throw py::error_already_set();
  }
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of symkin. Private: use the package symkin.";
  // symkin.errors defines the Python side; InvalidInput is a ValueError there.
  const py::object errors = py::module_::import("symkin.errors");
  static py::exception<symkin::Error> base(module, "Error", errors.attr("SymkinError").ptr());
  static py::exception<symkin::SymmetryMismatch> mismatch(module, "SymmetryMismatch",
                                                          errors.attr("SymmetryError").ptr());
  static py::exception<symkin::NotIdentifiable> hidden(module, "NotIdentifiable",
                                                       errors.attr("NotIdentifiableError").ptr());
  static py::exception<symkin::ImpossibleLeg> impossible(module, "ImpossibleLeg",
                                                         errors.attr("MechanismError").ptr());
  static py::exception<symkin::FailedFit> failed(module, "FailedFit",
                                                 errors.attr("FailedFitError").ptr());
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) {
        std::rethrow_exception(pointer);
      }
    } catch (const symkin::SymmetryMismatch& error) {
      py::set_error(mismatch, error.what());
    } catch (const symkin::NotIdentifiable& error) {
      // The directions travel with the exception, for a caller that can name them.
      py::object raised = static_cast<const py::object&>(hidden)(error.what());
      raised.attr("null_directions") = error.null_directions;
      PyErr_SetObject(hidden.ptr(), raised.ptr());
    } catch (const symkin::FailedFit& error) {
      py::set_error(failed, error.what());
    } catch (const symkin::ImpossibleLeg& error) {
      py::set_error(impossible, error.what());
    } catch (const symkin::Error& error) {
      py::set_error(base, error.what());
    }
  });
  symkin::set_interrupt_hook(&raise_signals);
  bind_model(module);
  bind_declared(module);
  bind_kinematics(module);
  bind_symmetry(module);
  bind_statistics(module);
  bind_tables(module);
  bind_estimation(module);
  bind_design(module);
}
