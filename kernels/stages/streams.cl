// All stages on CPUs: one program. For each program PoCL reads headers of its own, and reading takes longer than loading what was compiled.
// Their order tells in the last bits of a picture: from lib/arithmetic.cl on, which tracing includes, no product is fused with a sum; what comes
// before may be.
#include "stages/generate_stream.cl"
#include "stages/shade.cl"
#include "stages/wake_stream.cl"
#include "stages/trace_stream.cl"
