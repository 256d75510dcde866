#include <gtest/gtest.h>

#include <random>

#include "base/hash.hpp"

namespace raypager {
namespace {

// However the bytes are cut, and for every way in which xxHash handles lengths: up to 16, 128, 240 bytes, a block of 1024, several.
TEST(Hash64Stream, AgreesWithTheHashOfTheWhole) {
    std::mt19937 random(1);
    for (const size_t size : {0u, 1u, 16u, 17u, 128u, 129u, 240u, 241u, 1024u, 1025u, 5000u, 100000u})
        for (const uint64_t seed : {uint64_t{0}, uint64_t{1}, ~uint64_t{0}}) {
            std::vector<std::byte> bytes(size);
            for (std::byte& b : bytes) b = static_cast<std::byte>(random());
            Hash64Stream stream(seed);
            for (size_t at = 0; at < size;) {
                const size_t count = std::min<size_t>(size - at, 1 + random() % 700);
                stream.add(std::span(bytes).subspan(at, count));
                at += count;
            }
            EXPECT_EQ(stream.value(), hash64(bytes, seed)) << size << " bytes, seed " << seed;
        }
}

}  // namespace
}  // namespace raypager
