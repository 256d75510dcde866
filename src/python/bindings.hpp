// The parts of the module raypager._raypager, each of which one file adds.
#pragma once

#include <nanobind/nanobind.h>

namespace raypager::python {

void add_devices(nanobind::module_& module);
void add_blocks(nanobind::module_& module);
void add_render(nanobind::module_& module);
void add_scene(nanobind::module_& module);
void add_materials(nanobind::module_& module);
void add_textures(nanobind::module_& module);
void add_program(nanobind::module_& module);

}  // namespace raypager::python
