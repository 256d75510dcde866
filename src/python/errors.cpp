#include "python/errors.hpp"

#include <nanobind/nanobind.h>

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

}  // namespace raypager::python
