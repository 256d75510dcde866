// The command line, for "python -m raypager".
#include "cli/program.hpp"

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "python/arrays.hpp"
#include "python/bindings.hpp"
#include "python/errors.hpp"
#include "raypager/import.hpp"
#include "raypager/kernel_builder.hpp"

namespace raypager::python {
namespace {

// read: of a path and a look, a Scene.
SceneReader reader_of(nb::object read) {
    return [kept = keep(std::move(read))](const std::filesystem::path& path, const ImportOptions& options) -> Result<Scene> {
        const nb::gil_scoped_acquire gil;
        try {
            return nb::cast<Scene>((*kept)(path, options.look));
        } catch (const nb::python_error& error) {
            return status_of(error);
        } catch (const nb::cast_error&) {
            return Status::failed(path.string() + ": what reads it gives no scene");
        }
    };
}

}  // namespace

void add_program(nanobind::module_& module) {
    module.def("set_kernel_builder", &set_kernel_builder);
    // Files with these endings, if any, are read by `read`.
    module.def(
        "run_program",
        [](const std::vector<std::string>& arguments, const std::vector<std::string>& endings, const nb::object& read) {
            for (const std::string& ending : endings) use_scene_reader(ending, reader_of(read));
            const int status = without_gil([&] { return run_program(arguments); });
            for (const std::string& ending : endings) use_scene_reader(ending, nullptr);
            return status;
        },
        nb::arg("arguments"), nb::arg("endings"), nb::arg("read").none());
}

}  // namespace raypager::python
