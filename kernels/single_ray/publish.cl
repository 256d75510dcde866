// With single rays, before a round: changes the page table.
#include "common/page_changes.cl"

// One work-item, since Mesa's rusticl does not compile an index into arguments that differs between work-items.
__kernel void rp_publish(__global rp_page* restrict pages, rp_page_changes changes) { rp_change_pages(pages, &changes); }
