// All stages on CPUs: one program. For each program PoCL reads headers of its own, and reading takes longer than loading what was compiled.
#include "stream/generate.cl"
#include "shading/shade.cl"
#include "stream/wake.cl"
#include "stream/trace.cl"
#include "common/report.cl"
