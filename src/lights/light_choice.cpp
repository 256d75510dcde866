#include "lights/light_choice.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "lights/light_tree.hpp"
#include "lights/steps.hpp"

namespace raypager {
namespace {

static_assert(sizeof(rp_light_node) == 32);

bool has_place(const rp_light& light) { return light.kind != RP_LIGHT_INFINITE && light.kind != RP_LIGHT_DISTANT; }

bool share_an_edge(const rp_light& a, const rp_light& b) {
    if (a.kind != RP_LIGHT_TRIANGLE || b.kind != RP_LIGHT_TRIANGLE) return false;
    const auto corner = [](const rp_light& light, int i, int axis) {
        return i == 0 ? light.p[axis] : i == 1 ? light.p[axis] + light.e1[axis] : light.p[axis] + light.e2[axis];
    };
    int shared = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            bool same = true;
            // Edges are rounded.
            for (int axis = 0; axis < 3; axis++)
                same &= std::abs(corner(a, i, axis) - corner(b, k, axis)) <=
                        1e-5f * std::max(std::abs(a.e1[axis]), std::abs(a.e2[axis])) + 1e-6f * std::abs(a.p[axis]);
            shared += same;
        }
    return shared >= 2;
}

std::vector<uint32_t> tree_words(std::vector<rp_light>& lights) {
    std::vector<uint32_t> placed, others;
    std::vector<double> shares = {0};
    for (uint32_t i = 0; i < lights.size(); i++) {
        (has_place(lights[i]) ? placed : others).push_back(i);
        (has_place(lights[i]) ? shares.front() : shares.emplace_back(0)) += lights[i].probability;
    }
    const std::vector<uint32_t> steps = steps_of(shares);
    for (size_t i = 0; i < others.size(); i++) lights[others[i]].probability = share_of_step(steps, i + 1);
    const LightTree tree = build_light_tree(lights, placed);

    std::vector<uint32_t> words(RP_LIGHT_TREE_PAIRS + tree.nodes.size() * 8 + lights.size() * 2);
    std::memcpy(&words[RP_LIGHT_TREE_PAIRS], tree.nodes.data(), tree.nodes.size() * sizeof tree.nodes[0]);
    words[RP_LIGHT_TREE_WAYS] = static_cast<uint32_t>(RP_LIGHT_TREE_PAIRS + tree.nodes.size() * 8);
    for (size_t i = 0; i < lights.size(); i++) {
        words[words[RP_LIGHT_TREE_WAYS] + 2 * i] = static_cast<uint32_t>(tree.ways[i]);
        words[words[RP_LIGHT_TREE_WAYS] + 2 * i + 1] = static_cast<uint32_t>(tree.ways[i] >> 32);
    }
    words[RP_LIGHT_TREE_STEPS] = static_cast<uint32_t>(words.size());
    words[RP_LIGHT_TREE_COUNT] = static_cast<uint32_t>(steps.size());
    words.insert(words.end(), steps.begin(), steps.end());
    words[RP_LIGHT_TREE_OTHERS] = static_cast<uint32_t>(words.size());
    words.insert(words.end(), others.begin(), others.end());
    return words;
}

}  // namespace

bool has_light_tree(std::span<const rp_light> lights) {
    constexpr size_t most = size_t{1} << 27;  // words are numbered in 32 bits
    if (lights.size() > most) return false;
    const rp_light* met[2] = {};
    size_t count = 0;
    for (const rp_light& light : lights) {
        if (!has_place(light) || !(light_strength(light) > 0)) continue;
        if (count == 2) return true;
        met[count++] = &light;
    }
    return count == 2 && !share_an_edge(*met[0], *met[1]);
}

std::vector<uint32_t> light_choice(std::vector<rp_light>& lights) {
    if (has_light_tree(lights)) return tree_words(lights);
    std::vector<double> probabilities;
    for (const rp_light& light : lights) probabilities.push_back(light.probability);
    std::vector<uint32_t> steps = steps_of(probabilities);
    for (size_t i = 0; i < lights.size(); i++) lights[i].probability = share_of_step(steps, i);
    return steps;
}

uint64_t light_choice_bytes(std::span<const rp_light> lights) {
    if (!has_light_tree(lights)) return lights.size() * sizeof(uint32_t);
    const auto placed = static_cast<uint64_t>(std::count_if(lights.begin(), lights.end(), has_place)), others = lights.size() - placed;
    return (RP_LIGHT_TREE_PAIRS + 2 * lights.size() + 1 + 2 * others) * sizeof(uint32_t) + 2 * (placed - 1) * sizeof(rp_light_node);
}

}  // namespace raypager
