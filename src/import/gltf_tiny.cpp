// The code of tinygltf, which is all in its header, compiled here: so the program needs no library of it.
#define TINYGLTF_IMPLEMENTATION
#include "import/gltf_tiny.hpp"
