// OpenImageIO as the library for pictures (formats.hpp). What needs no pictures is not linked with it: it brings 230 shared libraries, which take a
// quarter of a second to load.
#pragma once

namespace raypager {

void use_openimageio();

}  // namespace raypager
