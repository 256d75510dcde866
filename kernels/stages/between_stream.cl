// The stages between tracing, on CPUs: one program, since reading a program's text takes longer there than loading what was compiled from it.
#include "stages/generate.cl"
#include "stages/shade.cl"
#include "stages/wake_stream.cl"
