// Names for code that is written once for RP_LANES lanes: 1 (scalars), 8 or 16. Files that begin with this end with end_lanes.cl, and may be
// included once for each number of lanes. One lane gets the same results as sixteen, to the bit, as long as only operations are used that
// every number of lanes does alike. Conditions are RP_INTS, as comparisons make them or -1 for true; they are joined with & and |.
// RP_MASK: bit k is the condition of lane k (stream/vector.cl). RP_MUL and RP_ADD are not fused with anything: only devices whose compilers keep
// FP_CONTRACT OFF have more than one lane.
#define RP_JOIN_(a, b) a##b
#define RP_JOIN(a, b) RP_JOIN_(a, b)
#if RP_LANES == 1
#define RP_FLOATS float
#define RP_INTS int
#define RP_UINTS uint
#define RP_ANY(condition) (condition)
#define RP_MASK(condition) ((condition) ? 1u : 0u)
#define RP_MUL(a, b) rp_mul(a, b)
#define RP_ADD(a, b) rp_add(a, b)
#define RP_TO_NEAREST_INTS(x) convert_int_rte(x)
#define RP_LOAD(from) (*(from))
#define RP_STORE(values, to) (*(to) = (values))
#else
#define RP_FLOATS RP_JOIN(float, RP_LANES)
#define RP_INTS RP_JOIN(int, RP_LANES)
#define RP_UINTS RP_JOIN(uint, RP_LANES)
#define RP_ANY(condition) any(condition)
#define RP_MASK(condition) RP_JOIN(rp_mask, RP_LANES)(condition)
#define RP_MUL(a, b) ((a) * (b))
#define RP_ADD(a, b) ((a) + (b))
// PoCL converts to the nearest integers lane by lane.
#define RP_TO_NEAREST_INTS(x) RP_TO_INTS(rint(x))
#define RP_LOAD(from) RP_JOIN(vload, RP_LANES)(0, from)
#define RP_STORE(values, to) RP_JOIN(vstore, RP_LANES)(values, 0, to)
#endif
#define RP_AS_FLOATS RP_JOIN(as_, RP_FLOATS)
#define RP_AS_UINTS RP_JOIN(as_, RP_UINTS)
#define RP_AS_INTS RP_JOIN(as_, RP_INTS)
#define RP_TO_INTS RP_JOIN(convert_, RP_INTS)
#define RP_TO_FLOATS RP_JOIN(convert_, RP_FLOATS)
#define RP_NAME(name) RP_JOIN(name, RP_LANES)
