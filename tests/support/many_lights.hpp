// Lights of all kinds at random places, for tests of the choice among them.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "gather/lights.hpp"
#include "scene/emitters.hpp"

namespace raypager::support {

inline Float3 random_place(std::mt19937& random, float reach) {
    std::uniform_real_distribution<float> along(-reach, reach);
    const float x = along(random), y = along(random), z = along(random);
    return {x, y, z};
}

// count of them with a place, some of which are dark; others: so many besides, the first of them infinite. With probabilities.
inline std::vector<rp_light> many_lights(uint32_t count, uint32_t others, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<rp_light> lights;
    for (uint32_t i = 0; i < count; i++) {
        const Float3 p = random_place(random, 10), e1 = random_place(random, 0.5f), e2 = random_place(random, 0.5f);
        const float strength = std::pow(10.0f, random_place(random, 2).x);
        const AreaLight shines = {{strength, strength / 2, strength}, random() % 4 == 0};
        rp_light light = {};
        switch (random() % 4) {
            case 0:
                light = sphere_light(p, std::abs(e1.x) + 0.01f, shines);
                break;
            case 1:
                light.kind = RP_LIGHT_POINT;
                light.p[0] = p.x, light.p[1] = p.y, light.p[2] = p.z;
                for (float& channel : light.radiance) channel = i > 4 && i % 7 == 0 ? 0 : strength;
                break;
            default:
                light = triangle_light(p, {p.x + e1.x, p.y + e1.y, p.z + e1.z}, {p.x + e2.x, p.y + e2.y, p.z + e2.z}, shines);
        }
        lights.push_back(light);
    }
    for (uint32_t i = 0; i < others; i++) {
        rp_light light = {};
        light.kind = i == 0 ? RP_LIGHT_INFINITE : RP_LIGHT_DISTANT;
        light.p[1] = 1;
        for (float& channel : light.radiance) channel = 0.1f * static_cast<float>(i + 1);
        lights.push_back(light);
    }
    std::shuffle(lights.begin(), lights.end(), random);
    set_probabilities(lights, 15);
    return lights;
}

}  // namespace raypager::support
