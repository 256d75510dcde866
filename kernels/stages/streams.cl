// All stages on CPUs: one program, since for each PoCL reads headers of its own, and reading a program's text takes longer than loading what was
// compiled from it.
#include "stages/generate.cl"
#include "stages/shade.cl"
#include "stages/wake_stream.cl"
#include "stages/extend_stream.cl"
#include "stages/connect_stream.cl"
