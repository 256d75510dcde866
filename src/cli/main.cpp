#include "cli/program.hpp"
#include "raypager/kernel_builder.hpp"
#ifdef RAYPAGER_OPENIMAGEIO
#include "raypager/picture.hpp"
#endif

int main(int count, char** values) {
#ifdef RAYPAGER_OPENIMAGEIO
    raypager::use_openimageio();
#endif
    raypager::set_kernel_builder({"/proc/self/exe", raypager::kernel_builder_verb});
    return raypager::run_program({values + 1, values + (count > 0 ? count : 1)});
}
