// Ends what begin_lanes.cl began.
#undef RP_NAME
#undef RP_TO_FLOATS
#undef RP_TO_INTS
#undef RP_AS_INTS
#undef RP_AS_UINTS
#undef RP_AS_FLOATS
#undef RP_STORE
#undef RP_LOAD
#undef RP_ANY
#undef RP_MASK
#undef RP_MUL
#undef RP_ADD
#undef RP_UINTS
#undef RP_INTS
#undef RP_FLOATS
#undef RP_JOIN
#undef RP_JOIN_
