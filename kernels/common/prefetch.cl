// Memory that is asked for before it is needed; nothing where the compiler does not name a CPU that has use for it.
#ifndef RP_PREFETCH_CL
#define RP_PREFETCH_CL

// Asks for the cache line at an address that will be read soon.
#if defined(__AVX2__) && !defined(RP_PORTABLE)
#define rp_prefetch(address) __builtin_prefetch((const void*)(ulong)(address))
#else
#define rp_prefetch(address) (void)(address)
#endif

#endif
