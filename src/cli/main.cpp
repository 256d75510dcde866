#include "cli/program.hpp"
#ifdef RAYPAGER_OPENIMAGEIO
#include "raypager/picture.hpp"
#endif

int main(int count, char** values) {
#ifdef RAYPAGER_OPENIMAGEIO
    raypager::use_openimageio();
#endif
    return raypager::run_program({values + 1, values + (count > 0 ? count : 1)});
}
