// raypager._raypager: the public library as Python sees it, plain and typed. What users call is the package around it (raypager/).
#include <nanobind/nanobind.h>

#include "python/bindings.hpp"
#include "raypager/picture.hpp"

NB_MODULE(_raypager, module) {
    using namespace raypager;
    nanobind::set_leak_warnings(false);  // a traceback that is shown at the end keeps what was in use
    module.doc() = "The engine's part of raypager. Use the package raypager, which checks what it hands on.";
    module.attr("VERSION") = RAYPAGER_VERSION;
#ifdef RAYPAGER_OPENIMAGEIO
    use_openimageio();
    module.attr("writes_png") = true;
#else
    module.attr("writes_png") = false;
#endif
    python::add_devices(module);
    python::add_materials(module);
    python::add_textures(module);
    python::add_scene(module);
    python::add_blocks(module);
    python::add_render(module);
    python::add_program(module);
}
