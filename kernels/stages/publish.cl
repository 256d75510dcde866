// Between rounds: entries of the page table that have changed.
#include "raypager/abi/block.h"

// One work-item, since Mesa's rusticl does not compile an index into arguments that differs between work-items.
__kernel void rp_publish(__global rp_page* restrict pages, rp_page_changes changes) {
    for (uint i = 0u; i < RP_PAGE_CHANGES; i++) {
        rp_page page = changes.pages[i];
        if (page.unused == RP_NONE) return;
        const uint block = page.unused;
        page.unused = 0u;
        pages[block] = page;
    }
}
