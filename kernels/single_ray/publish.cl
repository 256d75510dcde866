// With single rays, before a round: changes the page table. And after it: what is told of it.
#include "common/page_changes.cl"
#include "common/report.cl"

// Who waits for a block that has come is woken in this round, so nobody waits for it then. One work-item, since Mesa's rusticl does not compile an
// index into arguments that differs between work-items.
__kernel void rp_publish(__global rp_page* restrict pages, uint block_count, __global uint* restrict demand, rp_page_changes changes) {
    rp_change_pages(pages, &changes);
    for (uint i = 0u; i < RP_PAGE_CHANGES; i++) {
        const rp_page page = changes.pages[i];
        if (page.block == RP_NONE) return;
        if (page.address != RP_NONE) rp_end_requests(demand, block_count, page.block);
    }
}
