// Fixed-width types for structs that the host (C++17 and later) and the kernels (OpenCL C 1.2) share.
#ifndef RAYPAGER_ABI_TYPES_H
#define RAYPAGER_ABI_TYPES_H

#ifdef __OPENCL_VERSION__
typedef uchar rp_u8;
typedef uint rp_u32;
typedef ulong rp_u64;
#else
#include <stdint.h>
typedef uint8_t rp_u8;
typedef uint32_t rp_u32;
typedef uint64_t rp_u64;
#endif

// "No such index" wherever an index may be missing.
#define RP_NONE 0xffffffffu

#endif
