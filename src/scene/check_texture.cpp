#include "scene/check_texture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace raypager {
namespace {

constexpr uint32_t known_wraps = 0xfu << RP_TEXTURE_WRAP_SHIFT, known_channels = RP_TEXTURE_CHANNEL_MASK << RP_TEXTURE_CHANNEL_SHIFT,
                   jitter = RP_TEXTURE_JITTER_MASK << RP_TEXTURE_JITTER_SHIFT;
constexpr uint32_t last_channel = 6;

// What an operation takes off the stack and puts there, its flags beside RP_TEXTURE_LAST, and whether it looks at a map.
struct OperationKind {
    uint32_t takes, puts, flags;
    bool maps;
};
constexpr OperationKind kinds[RP_TEXTURE_OPERATIONS] = {
    {0, 1, 0, false},                                                         // constant
    {0, 1, RP_TEXTURE_INVERT | known_channels | known_wraps | jitter, true},  // image
    {2, 1, 0, false},                                                         // scale
    {3, 1, 0, false},                                                         // mix
    {2, 1, RP_TEXTURE_SOLID, true},                                           // checks
    {2, 1, 0, true},                                                          // dots
    {4, 1, 0, true},                                                          // bilerp
    {2, 1, 0, false},                                                         // direction
    {0, 1, 0, true},
    {0, 1, 0, true},
    {0, 1, 0, true},
    {0, 1, 0, true},                   // fbm, wrinkled, windy, marble
    {0, 1, 0, true},                   // uv
    {1, 0, RP_TEXTURE_INVERT, false},  // set
    {0, 0, 0, false},                  // shift
    {3, 0, 0, false},                  // bump
};

uint32_t operation_of(const rp_texture_op& op) { return op.op & RP_TEXTURE_OPERATION_MASK; }

bool are_finite(std::span<const float> values) {
    return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

bool has_octaves(uint32_t operation) { return operation == RP_TEXTURE_FBM || operation == RP_TEXTURE_WRINKLED || operation == RP_TEXTURE_MARBLE; }

const char* fault_of_operation(const TexturePrograms& programs, const rp_texture_op& op) {
    const uint32_t operation = operation_of(op);
    if (operation >= RP_TEXTURE_OPERATIONS) return "is unknown";
    const OperationKind& kind = kinds[operation];
    if (op.op & ~(RP_TEXTURE_OPERATION_MASK | RP_TEXTURE_LAST | kind.flags)) return "has unknown flags";
    if ((op.op >> RP_TEXTURE_CHANNEL_SHIFT & RP_TEXTURE_CHANNEL_MASK) > last_channel) return "reads an unknown channel";
    if (!are_finite(op.a) || !are_finite(op.b)) return "has numbers that are not finite";
    if (has_octaves(operation) && !(op.a[0] >= 0 && op.a[0] <= max_octaves)) return "has too many octaves";
    if (operation == RP_TEXTURE_IMAGE && op.image >= programs.images) return "names an image that does not exist";
    if (operation == RP_TEXTURE_SET && op.image >= RP_PARAMETERS) return "sets an unknown parameter";
    if (kind.maps && op.map != RP_NONE && op.map >= programs.maps.size()) return "names coordinates that do not exist";
    return nullptr;
}

// One program, from its first operation to its last.
class ProgramCheck {
public:
    explicit ProgramCheck(const TexturePrograms& programs) : programs_(programs) {}
    const char* fault(std::span<const rp_texture_op> program) {
        uint32_t stack = 0;
        for (const rp_texture_op& op : program) {
            if (const char* fault = fault_of_operation(programs_, op)) return fault;
            const OperationKind& kind = kinds[operation_of(op)];
            if (stack < kind.takes) return "takes more off the stack than is there";
            stack += kind.puts - kind.takes;
            if (stack > RP_TEXTURE_STACK) return "puts more on the stack than it holds";
        }
        return fault_of_texels(program);
    }

private:
    struct Texel {
        uint32_t first, end;
        const rp_texture_op* op;
    };

    static bool same_texel(const rp_texture_op& a, const rp_texture_op& b) {
        return a.lookup == b.lookup && a.image == b.image && a.map == b.map && (a.op & known_wraps) == (b.op & known_wraps);
    }

    const char* fault_of_texels(std::span<const rp_texture_op> program) {
        texels_.clear();
        for (const rp_texture_op& op : program) {
            if (operation_of(op) != RP_TEXTURE_IMAGE) continue;
            const uint32_t words = programs_.texel_words ? programs_.texel_words(op.image) : 1;
            if (op.lookup >= RP_TEXEL_WORDS || op.lookup + words > RP_TEXEL_WORDS) return "has its texel out of reach";
            texels_.push_back({op.lookup, op.lookup + words, &op});
        }
        std::ranges::sort(texels_, {}, &Texel::first);
        for (size_t i = 0; i < texels_.size(); i++) {
            if (i > 0 && texels_[i].first < texels_[i - 1].end && !same_texel(*texels_[i].op, *texels_[i - 1].op))
                return "has two texels in one place";
        }
        return nullptr;
    }

    const TexturePrograms& programs_;
    std::vector<Texel> texels_;
};

Status check_maps(std::span<const rp_texture_map> maps) {
    for (size_t i = 0; i < maps.size(); i++) {
        if (maps[i].kind > RP_MAP_CYLINDER) return Status::failed(fmt::format("coordinates {} are of an unknown kind", i));
        if (!are_finite(maps[i].m) || !are_finite(maps[i].scale) || !are_finite(maps[i].offset))
            return Status::failed(fmt::format("coordinates {} are not finite", i));
    }
    return {};
}

// A parameter that the material does not have would be written over another.
const char* fault_of_parameter(const rp_material& material, uint32_t parameter) {
    const bool may_be_brushed = material.kind == RP_MATERIAL_CONDUCTOR || material.kind == RP_MATERIAL_LAYERED;
    const bool metal_base = material.kind == RP_MATERIAL_LAYERED && (material.flags & RP_MATERIAL_METAL_BASE);
    if ((parameter == RP_PARAMETER_AMOUNT) != (material.kind == RP_MATERIAL_MIX)) return "sets what only a mix has, or not even that";
    if (parameter == RP_PARAMETER_ALPHA_ACROSS && !(may_be_brushed && RP_ALPHA_ACROSS(material) > 0))
        return "gives roughness a direction that has none";
    if (parameter == RP_PARAMETER_BASE_ALPHA_ACROSS && !(metal_base && RP_BASE_ALPHA_ACROSS(material) > 0))
        return "gives the roughness of a base a direction that has none";
    return nullptr;
}

}  // namespace

Status check_textures(const TexturePrograms& programs) {
    RAYPAGER_TRY(check_maps(programs.maps));
    ProgramCheck check(programs);
    std::vector<bool> begins(programs.ops.size());
    size_t first = 0;
    for (size_t i = 0; i < programs.ops.size(); i++) {
        if (!(programs.ops[i].op & RP_TEXTURE_LAST)) continue;
        begins[first] = true;
        if (const char* fault = check.fault(programs.ops.subspan(first, i + 1 - first)))
            return Status::failed(fmt::format("in the program at operation {} one {}", first, fault));
        first = i + 1;
    }
    if (first != programs.ops.size()) return Status::failed(fmt::format("the program at operation {} has no end", first));
    for (size_t i = 0; i < programs.materials.size(); i++) {
        const uint32_t program = program_of(programs.materials[i]);
        if (program != RP_NONE && (program >= begins.size() || !begins[program]))
            return Status::failed(fmt::format("material {} names a program that does not exist", i));
        for (size_t at = program; program != RP_NONE; at++) {
            const rp_texture_op& op = programs.ops[at];
            const bool sets = operation_of(op) == RP_TEXTURE_SET && op.image != RP_PARAMETER_NORMAL;
            if (const char* fault = sets ? fault_of_parameter(programs.materials[i], op.image) : nullptr)
                return Status::failed(fmt::format("in the program of material {} an operation {}", i, fault));
            if (op.op & RP_TEXTURE_LAST) break;
        }
    }
    return {};
}

}  // namespace raypager
