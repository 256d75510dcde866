// Which inputs of a target get a long look as well as a short one.
#pragma once

#include <cstdlib>

#include "base/hash.hpp"

namespace raypager::fuzz {

// One in some hundreds (RENDER_EVERY=N: in N; 0: none). By the input alone, and in no way that a fuzzer could learn: such inputs would soon be all
// that it tries.
inline bool is_rendered(std::string_view input) {
    static const uint64_t every = [] {
        const char* value = std::getenv("RENDER_EVERY");
        return value ? std::strtoull(value, nullptr, 10) : 300;
    }();
    return every > 0 && hash64(input) % every == 0;
}

}  // namespace raypager::fuzz
