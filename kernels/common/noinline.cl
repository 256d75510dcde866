// Functions that stay functions.
#ifndef RP_NOINLINE_CL
#define RP_NOINLINE_CL

// Not inlined. PoCL makes three functions of every kernel and compiles each with all that is inlined into it: where a kernel does much, it calls one
// of these to do it, which is compiled once. There it must not ask for its work-item's number.
#define RP_NOINLINE __attribute__((noinline))

#endif
