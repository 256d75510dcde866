// The film as the device accumulates it: sums in fixed point, so that the order of additions does not matter.
#ifndef RAYPAGER_ABI_FILM_H
#define RAYPAGER_ABI_FILM_H

#include "raypager/abi/types.h"

// A pixel is RP_FILM_WORDS words: for each of r, g, b the sum of sample radiance * 2^RP_FILM_SCALE_BITS, low word first,
// then the number of finished samples, then the number of samples that were clamped or not finite (those count as their clamp, or 0).
// Where the background is transparent, the upper half of the number of finished samples counts those whose camera ray met nothing: there are at most
// 65535 of either.
#define RP_FILM_WORDS 8
#define RP_FILM_SCALE_BITS 28
#define RP_FILM_MAX_RADIANCE 1048576.0f  // 2^20: 65535 samples of it fit into 64 bits
#define RP_FILM_COUNT 6
#define RP_FILM_COUNT_MASK 0xffffu
#define RP_FILM_MISSES_SHIFT 16
#define RP_FILM_CLAMPED 7

// Behind these words may come those of layers (raypager/film_layers.hpp). Where they lie, and how many words a pixel has then, the host tells kernels
// (film/film_layout): RP_FILM_STRIDE, RP_LAYER_ALBEDO, ... Albedo and variance are sums as those of light; so are, of normals, (n + 1) / 2 of each
// coordinate, with the number of samples that met something behind them. The others are words as they are, of a pixel's first sample: floats, or
// numbers from 1. Zero: nothing was met.
// Where sampling is adaptive, the first words behind those of light are the host's (render/adaptive): the sum of luminance before the stage, a
// double, and how many samples the pixel is to have at its end.
#define RP_ADAPTIVE_WORDS 3
#define RP_ADAPTIVE_GRANTED 2
#define RP_NORMAL_LAYER_WORDS 7
#define RP_NORMAL_LAYER_COUNT 6
#define RP_VARIANCE_MAX_LUMINANCE 1024.0f  // samples count as at most that: its square is the largest radiance

#endif
