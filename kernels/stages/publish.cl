// Between rounds: entries of the page table that have changed.
#include "raypager/abi/block.h"

// One work-item an entry, RP_PAGE_CHANGES of them.
__kernel void rp_publish(__global rp_page* restrict pages, rp_page_changes changes) {
    const uint i = get_global_id(0);
    if (i >= RP_PAGE_CHANGES || changes.pages[i].unused == RP_NONE) return;
    rp_page page = changes.pages[i];
    const uint block = page.unused;
    page.unused = 0u;
    pages[block] = page;
}
