#include "block/strip.hpp"

#include <algorithm>

#include "base/check.hpp"

namespace raypager {
namespace {

// Whether (a, b, c) lists the triangle's vertices counter-clockwise (+1), clockwise (-1), or lists other vertices (0).
int orientation(const Triangle& t, uint32_t a, uint32_t b, uint32_t c) {
    for (int i = 0; i < 3; i++) {
        if (t[i] != a) continue;
        if (t[(i + 1) % 3] == b && t[(i + 2) % 3] == c) return 1;
        if (t[(i + 1) % 3] == c && t[(i + 2) % 3] == b) return -1;
    }
    return 0;
}

// The vertex besides a and b, or RP_NONE if the triangle does not have both.
uint32_t third_vertex(const Triangle& t, uint32_t a, uint32_t b) {
    for (int i = 0; i < 3; i++) {
        const uint32_t u = t[i], v = t[(i + 1) % 3];
        if ((u == a && v == b) || (u == b && v == a)) return t[(i + 2) % 3];
    }
    return RP_NONE;
}

class Chain {
public:
    Chain(std::span<const Triangle> triangles, std::span<const uint32_t> order) : triangles_(triangles) {
        strip_.count = static_cast<uint32_t>(order.size());
        std::copy(order.begin(), order.end(), strip_.order);
    }

    // Tries the six ways to list the first triangle; the rest follows from it.
    bool find() {
        const Triangle& t = triangles_[strip_.order[0]];
        for (uint32_t rotation = 0; rotation < 3; rotation++) {
            for (const bool clockwise : {false, true}) {
                const uint32_t a = t[rotation], b = t[(rotation + (clockwise ? 2 : 1)) % 3], c = t[(rotation + (clockwise ? 1 : 2)) % 3];
                strip_.vertices[0] = a;
                strip_.vertices[1] = b;
                strip_.vertices[2] = c;
                strip_.flags = (strip_.count - 1) | (clockwise ? RP_LEAF_WINDING : 0);
                if (extend(1, a, b, c, clockwise ? -1 : 1)) return true;
            }
        }
        return false;
    }

    const Strip& strip() const { return strip_; }

private:
    // Triangle k - 1 is (a, b, c), listed with the given orientation; goes on with triangle k.
    bool extend(uint32_t k, uint32_t a, uint32_t b, uint32_t c, int listed) {
        if (k == strip_.count) return true;
        const Triangle& next = triangles_[strip_.order[k]];
        for (const bool keeps_first : {false, true}) {
            const uint32_t kept = keeps_first ? a : b;
            const int next_listed = keeps_first ? listed : -listed;
            const uint32_t fresh = third_vertex(next, kept, c);
            if (fresh == RP_NONE || orientation(next, kept, c, fresh) != next_listed) continue;
            const uint32_t bit = 1u << (2 + k - 1);
            strip_.vertices[k + 2] = fresh;
            strip_.flags = (strip_.flags & ~bit) | (keeps_first ? bit : 0);
            if (extend(k + 1, kept, c, fresh, next_listed)) return true;
        }
        return false;
    }

    std::span<const Triangle> triangles_;
    Strip strip_;
};

}  // namespace

Strip make_strip(std::span<const Triangle> triangles, std::span<const uint32_t> order) {
    RAYPAGER_CHECK(!order.empty() && order.size() <= RP_LEAF_MAX_PRIMITIVES);
    Chain chain(triangles, order);
    RAYPAGER_CHECK(chain.find());
    return chain.strip();
}

}  // namespace raypager
