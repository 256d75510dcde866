// Block files taken apart and put together, for tests that damage them on purpose.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace raypager::support {

// Makes all checksums right again, those of the header, of the sections, and in the tables of blocks and pages those of these, wherever what
// they cover lies within the file. REQUIRES: room for a header.
void seal_block_file(std::string& bytes);

// A block file without the zeros that fill its pages: pieces one after the other, each with its length before it (4 bytes). A few
// kilobytes for a small scene, so that changes at random hit something. spread_pages() takes any input for such pieces.
std::string squeeze_pages(std::string_view bytes);
std::string squeeze_parts(std::string_view bytes, const std::vector<std::pair<uint64_t, uint64_t>>& offsets_and_sizes);
std::string spread_pages(std::string_view squeezed);

}  // namespace raypager::support
