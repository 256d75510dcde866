// The JSON of a glTF file, before tinygltf sees it. tinygltf believes what a file says of itself: it follows nesting by recursion, takes memory for
// all that nobody reads, and looks into buffers of images before anybody has checked where they end. So what it is to read is checked and made
// smaller first. It also knows neither buffers that are there as a fallback alone, nor indices that only Draco has.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

struct GltfBuffer {
    enum class Place { chunk, file, text, nowhere };  // of a GLB; a file beside it; in the JSON itself; a fallback that is not there
    Place place = Place::text;
    std::string uri;     // of a file, as it is written
    uint64_t bytes = 0;  // that it declares
};

struct GltfJson {
    std::string text;                         // what tinygltf is to read. Buffers in chunks and files have their number as their uri
    std::vector<GltfBuffer> buffers;          // by number
    std::vector<std::string> used, required;  // extensions
    std::string generator;
    bool has_animations = false;
};

// Whether an extension is read, be it in part.
bool is_known_gltf_extension(std::string_view extension);

// text: what the file `name` has. chunk_bytes: of binary data that a GLB has behind it.
Result<GltfJson> prepare_gltf_json(const std::string& name, std::string_view text, uint64_t chunk_bytes);

}  // namespace raypager
