// All stages on CPUs: one program. For each program PoCL reads headers of its own, and reading takes longer than loading what was compiled.
#include "stages/generate_stream.cl"
#include "stages/shade.cl"
#include "stages/wake_stream.cl"
#include "stages/trace_stream.cl"
