// The native module halflight._native, which api/python/halflight/__init__.py wraps.
#include <pybind11/numpy.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#include <vector>

#include "api/python/bindings.h"
#include "engine/core/memory_ledger.h"
#include "engine/gpu/context.h"

namespace halflight::python {

Log log_to(py::object sink) {
    const auto shared = std::shared_ptr<py::object>(new py::object(std::move(sink)), [](py::object* object) {
        const py::gil_scoped_acquire gil;
        delete object;
    });
    return Log([shared](Log::Kind kind, std::string_view line) {
        if (kind == Log::Kind::detail) return;
        const py::gil_scoped_acquire gil;
        try {
            (*shared)(kind == Log::Kind::warning, py::str(line.data(), line.size()));
        } catch (py::error_already_set& error) {
            const bool interrupts = error.matches(PyExc_KeyboardInterrupt);
            error.discard_as_unraisable("halflight log");
            if (interrupts) PyErr_SetInterrupt();  // the next look for signals raises it again
        }
    });
}

Unlocked::Counted::Counted() {
    if (ending) throw Error("halflight", "cannot begin work while the interpreter ends");
    ++running;
}

void Unlocked::end_all() {
    ending = true;
    const py::gil_scoped_release released;
    while (running > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

bool Callback::operator()(const std::function<py::object()>& make) {
    if (Unlocked::ending) return false;
    if (!make) {
        if (watch_.seconds() - looked_ < 0.05) return !error_;
        looked_ = watch_.seconds();
    }
    const gpu::KeepCurrent keep;  // the function may render, and garbage collection may delete renderers
    const py::gil_scoped_acquire gil;
    if (error_) return false;
    try {
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        if (function_.is_none() || !make) return true;
        const py::object answer = function_(make());
        return answer.is_none() || answer.cast<bool>();
    } catch (py::error_already_set& error) {
        error_.emplace(error);
    } catch (const py::cast_error&) {
        PyErr_SetString(PyExc_TypeError, "a progress callback returns None, True or False");
        error_.emplace();
    }
    return false;
}

void Callback::rethrow() {
    if (error_) throw py::error_already_set(*error_);
}

}  // namespace halflight::python

PYBIND11_MODULE(_native, module) {
    namespace py = pybind11;
    module.doc() = "Native part of the package halflight.";
    // pybind11 loads NumPy at the first array, under a guard of C++, and may give up the interpreter's lock meanwhile.
    // Two threads with their first arrays would then wait for each other.
    py::array(py::dtype("f4"), std::vector<py::ssize_t>{0});
    py::register_exception<halflight::Error>(module, "Error", PyExc_RuntimeError).doc() =
        "Error of the library; its text is one line that names file and element.";
    module.def("limit_memory", [](const std::string& size) {
        const std::optional<std::size_t> bytes = halflight::parse_bytes(size);
        if (!bytes) throw halflight::Error("memory", "expects a size such as 2GiB, 1.5G or 800M, not '{}'", size);
        halflight::MemoryLedger::process().set_limit(*bytes);
    });
    py::module_::import("atexit").attr("register")(py::cpp_function([owner = getpid()] {
        if (getpid() == owner) halflight::python::Unlocked::end_all();  // forked processes lack the threads at work
    }));
    halflight::python::bind_scene(module);
    halflight::python::bind_picture(module);
    halflight::python::bind_renderer(module);
}
