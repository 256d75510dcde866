// All of the library but baselines.hpp, which is for measurements. A picture is made in four steps:
//   Scene   load one (import.hpp), or build it in memory (scene.hpp, materials.hpp)
//   Blocks  bake it, into a file or into memory (bake.hpp), or open a block file (blocks.hpp)
//   Session render it on a device (devices.hpp), step by step or at once (session.hpp)
//           or find out what a render would take (forecast.hpp, cluster_forecast.hpp)
//   Image   the picture (picture.hpp), with or without its noise (denoise.hpp)
// Errors are values (status.hpp). Lengths are in the scene's units, memory is in bytes, time in seconds, angles in degrees, colours are linear sRGB.
#pragma once

#include "raypager/bake.hpp"
#include "raypager/blocks.hpp"
#include "raypager/camera_text.hpp"
#include "raypager/cluster_forecast.hpp"
#include "raypager/denoise.hpp"
#include "raypager/devices.hpp"
#include "raypager/forecast.hpp"
#include "raypager/image_source.hpp"
#include "raypager/import.hpp"
#include "raypager/materials.hpp"
#include "raypager/picture.hpp"
#include "raypager/report.hpp"
#include "raypager/scene.hpp"
#include "raypager/session.hpp"
#include "raypager/sky.hpp"
#include "raypager/status.hpp"
#include "raypager/textures.hpp"
