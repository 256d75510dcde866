// Block files and checkpoints in which single fields are changed, and all checksums and sizes made right again: what is left to refuse them are the
// checks of what the fields say.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace raypager::support {

// So many bytes of a run of any bytes say one change: what is changed, how, and to what. What is left over says nothing.
inline constexpr size_t edit_bytes = 12;

// Changes a good file: items of sections, their counts and places, nodes, leaves, instances, vertices, spheres, ids and headers of blocks, texels of
// pages; and bounds, grids, counts and probabilities in all places that must agree. REQUIRES: bytes of a file that the reader takes.
void edit_block_file(std::string& bytes, std::string_view edits);

// The same of a checkpoint: its header, the samples under way, gaps, the film, and how many there are of each.
void edit_checkpoint(std::string& bytes, std::string_view edits);

// One to four changes at random.
std::string random_edits(uint64_t seed);

}  // namespace raypager::support
