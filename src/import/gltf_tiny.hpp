// tinygltf as it is used here: it reads JSON and buffers, and decodes no images.
#pragma once

// Debian's Draco has another version of it inside, and its names outside: whichever a linker came upon first, all would use.
#define tinygltf raypager_tinygltf
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>
