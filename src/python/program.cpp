// The command line, for "python -m raypager".
#include "cli/program.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "python/bindings.hpp"

namespace raypager::python {

void add_program(nanobind::module_& module) {
    module.def("run_program", [](const std::vector<std::string>& arguments) {
        const nanobind::gil_scoped_release release;
        return run_program(arguments);
    });
}

}  // namespace raypager::python
