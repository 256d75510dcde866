// Entries of the page table that have changed.
#ifndef RP_PAGE_CHANGES_CL
#define RP_PAGE_CHANGES_CL

#include "raypager/abi/block.h"

static inline void rp_change_pages(__global rp_page* pages, const rp_page_changes* changes) {
    for (uint i = 0u; i < RP_PAGE_CHANGES; i++) {
        rp_page page = changes->pages[i];
        if (page.block == RP_NONE) return;
        const uint block = page.block;
        page.block = 0u;
        pages[block] = page;
    }
}

#endif
