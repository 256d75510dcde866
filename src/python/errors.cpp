#include "python/errors.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <algorithm>

namespace nb = nanobind;

namespace raypager::python {

void raise(const Status& status) {
    const nb::object type = nb::module_::import_("raypager._errors").attr("Error");
    // A message may quote a file name, which need not be UTF-8.
    const std::string& text = status.message();
    const auto message = nb::steal(PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace"));
    const nb::object error = type(message, status.exit_code());
    PyErr_SetObject(type.ptr(), error.ptr());
    throw nb::python_error();
}

std::string text_of(const nb::python_error& error) {
    try {
        const std::string type = nb::cast<std::string>(error.type().attr("__name__"));
        std::string text = nb::cast<std::string>(nb::str(error.value()));
        std::replace(text.begin(), text.end(), '\n', ' ');
        return text.empty() ? type : type + ": " + text;
    } catch (const std::exception&) {
        return "an exception without words";  // to say what it is may fail as well
    }
}

Status status_of(const nb::python_error& error) {
    if (error.matches(PyExc_KeyboardInterrupt)) return Status::interrupted("stopped while the scene was read");
    try {
        if (!error.matches(nb::module_::import_("raypager._errors").attr("Error"))) return Status::failed(text_of(error));
        std::string message = nb::cast<std::string>(nb::str(error.value()));
        const int code = nb::cast<int>(error.value().attr("exit_code"));
        return code == 2 ? Status::usage(std::move(message)) : Status::failed(std::move(message));
    } catch (const std::exception&) {
        return Status::failed(text_of(error));
    }
}

}  // namespace raypager::python
