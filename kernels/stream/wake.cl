// First stage of a round on CPUs: does what single_ray/wake.cl does, with streams. Slots that wait are looked at once and fall asleep: they are in
// lists of the blocks that they wait for (abi/path.h). When a block has come, rp_begin_round takes its lists apart, and rp_wake_stream looks at all
// slots that are awake.
//
// Rays that can go on are queued in bundles of those that are in the same block, or in blocks that lie together, so that the rays of a stream have
// much in common; within a bundle in the order of their slots, so that what is read for neighbours lies together. Each work-item puts its share of
// them into bundles of its own.
#include "common/page_changes.cl"
#include "common/prefetch.cl"
#include "stream/vector.cl"
#include "common/waiting_lists.cl"

// The slots of one of `parts` shares of a block's lists are awake again, and their paths in the block. All lists in turn: where the next slot is
// has to be waited for. Returns how many they are.
static inline uint rp_wake_lists(volatile __global uint* lists, uint part, uint parts, uint block, const rp_paths* paths,
                                 volatile __global uint* awake) {
    uint link[2u * RP_LISTS], left = 0u, woken = 0u;
    for (uint k = part; k < 2u * RP_LISTS; k += parts) {
        link[k] = lists[k];
        left |= link[k] != 0u ? 1u << k : 0u;
        lists[k] = 0u;
    }
    while (left != 0u) {
        for (uint k = part; k < 2u * RP_LISTS; k += parts) {
            if (link[k] == 0u) continue;
            const uint slot = link[k] - 1u;
            link[k] = rp_wait_word(paths, slot);
            left &= link[k] == 0u ? ~(1u << k) : ~0u;
            rp_set_status(paths, slot, rp_woken_status(rp_status_of(paths, slot), k >= RP_LISTS, block));
            atomic_or(awake + slot / 32u, 1u << slot % 32u);
            woken++;
        }
    }
    return woken;
}

// Before rp_wake_stream: changes the page table, clears what is counted anew in each round, and wakes the rays of blocks that have come since the
// round before. named: how many of new_blocks are their numbers; these are resident once the table has been changed, and each is named once:
// whoever wakes a block's rays empties its lists, without a lock. RP_NONE: those are not all, and nothing is to be changed. awake: see abi/path.h.
// Where there are at least twice as many work-items as blocks, several share the lists of each.
__kernel void rp_begin_round(__global uint* restrict status, __global rp_page* restrict pages, uint block_count, uint slot_count,
                             volatile __global uint* restrict awake, volatile __global uint* restrict counters,
                             volatile __global uint* restrict demand, uint named, uint16 new_blocks, rp_page_changes changes) {
    const uint items = (uint)get_global_size(0), item = (uint)get_global_id(0);
    const rp_paths paths = {slot_count, status, 0};  // whose planes nothing here looks at
    if (item == 0u) {
        rp_change_pages(pages, &changes);
        for (uint i = 0u; i < RP_COUNTERS_PER_ROUND; i++) counters[i] = 0u;
    }
    uint names[RP_MAX_NAMED], woken = 0u;
    vstore16(new_blocks, 0, names);
    const uint count = named != RP_NONE ? named : block_count, parts = clamp(items / max(count, 1u), 1u, 2u * RP_LISTS);
    for (uint i = item; i < count * parts; i += items) {
        const uint block = named != RP_NONE ? names[i / parts] : i / parts;
        if (named == RP_NONE && pages[block].address == RP_NONE) continue;
        const uint here = rp_wake_lists(rp_lists_of(demand, block_count, block), i % parts, parts, block, &paths, awake);
        if (here != 0u) rp_request(demand, block_count, block, -here);
        woken += here;
    }
    if (woken != 0u) atomic_sub(counters + RP_COUNT_IN_LISTS, woken);
}

// Rays of each kind have bundles. Those of others are no use, but spare a branch that nobody could foresee.
#define RP_KIND_EXTEND 0u
#define RP_KIND_SHADOW 1u
#define RP_KIND_OTHER 2u
#define RP_KINDS 3u
static inline uint rp_kind_of(uint status) { return rp_extends(status) ? RP_KIND_EXTEND : rp_connects(status) ? RP_KIND_SHADOW : RP_KIND_OTHER; }

// From numbers of rays a bundle to where each begins. Returns their sum.
static inline uint rp_begin_bundles(uint* bundles) {
    uint before = 0u;
    for (uint b = 0u; b < RP_BUNDLES; b++) {
        const uint size = bundles[b];
        bundles[b] = before;
        before += size;
    }
    return before;
}

// Slots that are free, not all listed yet.
#define RP_FREE_AT_ONCE 1024u
typedef struct rp_free_slots {
    uint count, slot[RP_FREE_AT_ONCE];
} rp_free_slots;

static inline void rp_list_free(rp_free_slots* free, __global uint* free_list, volatile __global uint* counters) {
    if (free->count == 0u) return;
    const uint first = atomic_add(counters + RP_COUNT_FREE, free->count);
    for (uint i = 0u; i < free->count; i++) free_list[first + i] = free->slot[i];
    free->count = 0u;
}

#ifdef RP_TEXTURES
// Slots whose page of a texture has come, not all listed yet.
static inline void rp_list_textured(rp_free_slots* textured, __global uint* free_list, uint slot_count, volatile __global uint* counters) {
    if (textured->count == 0u) return;
    const uint first = atomic_add(counters + RP_COUNT_TEXTURED, textured->count);
    for (uint i = 0u; i < textured->count; i++) free_list[slot_count - 1u - (first + i)] = textured->slot[i];
    textured->count = 0u;
}
#endif

// Words of `awake` that are not 0: most are, and what the others stand for is to be asked for some words ahead.
#define RP_WORDS_AT_ONCE 1024u
#define RP_WORDS_AHEAD 6u
typedef struct rp_awake_words {
    uint next, end;  // to be looked through
    uint count, number[RP_WORDS_AT_ONCE];
} rp_awake_words;

static inline bool rp_next_words(rp_awake_words* words, const __global ulong* awake) {
    for (words->count = 0u; words->next < words->end && words->count < RP_WORDS_AT_ONCE; words->next++) {
        words->number[words->count] = words->next;
        words->count += awake[words->next] != 0ul ? 1u : 0u;
    }
    return words->count != 0u;
}

static inline void rp_prefetch_slots(const rp_awake_words* words, uint i, const __global uint* statuses, const __global ulong* awake) {
    if (i + RP_WORDS_AHEAD >= words->count) return;
    const uint word = words->number[i + RP_WORDS_AHEAD];
    const ulong slots = awake[word];
    for (uint part = 0u; part < RP_AWAKE_SLOTS; part += 16u)
        if ((slots >> part & 0xfffful) != 0ul) rp_prefetch(statuses + (RP_AWAKE_SLOTS * word + part));
}

static inline uint rp_bundle_of(uint status, uint bundle_scale) { return mul_hi(rp_last_block_of(status), bundle_scale); }

// awake: see abi/path.h. queue: has room for one more than slot_count for each work-item, which stands for nothing.
__kernel void rp_wake_stream(const __global uint* restrict statuses, uint slot_count, __global ulong* restrict awake, __global uint* restrict queue,
                             __global uint* restrict free_list, volatile __global uint* restrict counters, uint bundle_scale) {
    const uint items = (uint)get_global_size(0), words = RP_AWAKE_WORDS(slot_count), each = (words + items - 1u) / items;
    const uint first = min((uint)get_global_id(0) * each, words);
    rp_awake_words found;

    // How many rays there are of each bundle.
    uint bundles[RP_KINDS][RP_BUNDLES];
    for (uint b = 0u; b < RP_BUNDLES; b++) bundles[RP_KIND_EXTEND][b] = bundles[RP_KIND_SHADOW][b] = bundles[RP_KIND_OTHER][b] = 0u;
    rp_free_slots free;
    free.count = 0u;
#ifdef RP_TEXTURES
    rp_free_slots textured;
    textured.count = 0u;
#endif
    for (found.next = first, found.end = min(first + each, words); rp_next_words(&found, awake);) {
        for (uint i = 0u; i < found.count; i++) {
            rp_prefetch_slots(&found, i, statuses, awake);
            const uint word = found.number[i];
            ulong asleep = 0ul;
            for (ulong look = awake[word]; look != 0ul; look &= look - 1ul) {
                const uint bit = rp_lowest(look), slot = RP_AWAKE_SLOTS * word + bit, status = statuses[slot];
                bundles[rp_kind_of(status)][rp_bundle_of(status, bundle_scale)]++;
                asleep |= (rp_can_sleep(status) ? 1ul : 0ul) << bit;
                free.slot[free.count] = slot;
                free.count += rp_is_free(status) ? 1u : 0u;
                if (free.count == RP_FREE_AT_ONCE) rp_list_free(&free, free_list, counters);
#ifdef RP_TEXTURES
                textured.slot[textured.count] = slot;
                textured.count += rp_is_to_shade(status) ? 1u : 0u;
                if (textured.count == RP_FREE_AT_ONCE) rp_list_textured(&textured, free_list, slot_count, counters);
#endif
            }
            if (asleep != 0ul) awake[word] &= ~asleep;
        }
    }
    rp_list_free(&free, free_list, counters);
#ifdef RP_TEXTURES
    rp_list_textured(&textured, free_list, slot_count, counters);
#endif

    // Puts them there.
    const uint first_extend = atomic_add(counters + RP_COUNT_EXTEND, rp_begin_bundles(bundles[RP_KIND_EXTEND]));
    const uint nowhere = slot_count + (uint)get_global_id(0);
    const uint first_shadow = slot_count - 1u - atomic_add(counters + RP_COUNT_SHADOW, rp_begin_bundles(bundles[RP_KIND_SHADOW]));
    for (found.next = first; rp_next_words(&found, awake);) {
        for (uint i = 0u; i < found.count; i++) {
            rp_prefetch_slots(&found, i, statuses, awake);
            for (ulong look = awake[found.number[i]]; look != 0ul; look &= look - 1ul) {
                const uint slot = RP_AWAKE_SLOTS * found.number[i] + rp_lowest(look), status = statuses[slot], kind = rp_kind_of(status);
                const uint place = bundles[kind][rp_bundle_of(status, bundle_scale)]++;
                queue[kind == RP_KIND_EXTEND ? first_extend + place : kind == RP_KIND_SHADOW ? first_shadow - place : nowhere] = slot;
            }
        }
    }
}
