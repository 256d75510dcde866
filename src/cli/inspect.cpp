#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "block/block_coding.hpp"
#include "block/instanced_count.hpp"
#include "cli/report.hpp"
#include "cli/values.hpp"
#include "cli/verbs.hpp"
#include "cli/view.hpp"
#include "store/block_file.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

// Bytes by part, over all blocks.
struct Parts {
    uint64_t headers = 0, nodes = 0, leaves = 0, vertices = 0, spheres = 0, sphere_ids = 0, ids = 0, normals = 0, colors = 0, uvs = 0, instances = 0,
             padding = 0;

    uint64_t shown_primitives = 0;  // of the scene, those in instances once for each
    uint64_t content() const { return headers + nodes + leaves + vertices + spheres + sphere_ids + ids + normals + colors + uvs + instances; }
    void add(const Parts& other) {
        headers += other.headers, nodes += other.nodes, leaves += other.leaves, vertices += other.vertices;
        spheres += other.spheres, sphere_ids += other.sphere_ids, ids += other.ids, normals += other.normals, colors += other.colors,
            uvs += other.uvs, instances += other.instances, padding += other.padding;
    }
};

struct NamedPart {
    const char* name;
    uint64_t Parts::*bytes;
};
constexpr NamedPart named_parts[] = {
    {"nodes", &Parts::nodes},     {"leaves", &Parts::leaves},         {"vertices", &Parts::vertices}, {"ids", &Parts::ids},
    {"normals", &Parts::normals}, {"colors", &Parts::colors},         {"uvs", &Parts::uvs},           {"instances", &Parts::instances},
    {"spheres", &Parts::spheres}, {"sphere_ids", &Parts::sphere_ids}, {"headers", &Parts::headers},   {"padding", &Parts::padding}};

struct TopFigures {
    uint64_t block_entries = 0, nodes = 0;
    int depth = 0;  // steps from the root to the deepest block entry
};

TopFigures top_figures(const BakedScene& scene) {
    TopFigures figures{scene.block_entries.size(), scene.top_nodes.size(), 0};
    for (const uint64_t path : scene.block_entry_paths) figures.depth = std::max(figures.depth, int(std::bit_width(path)) - 1);
    return figures;
}

// Whose the bytes of blocks are, as they are stored.
struct BytesOf {
    uint64_t objects = 0, world = 0, instances = 0;
};

BytesOf bytes_of(const BakedScene& scene) {
    uint64_t of_objects = 0;
    for (const rp_object& object : scene.objects) of_objects += object.top.block_entry_count;
    const uint64_t first_of_world = of_objects < scene.block_entries.size() ? scene.block_entries[of_objects].block : scene.blocks.size();
    BytesOf bytes;
    for (size_t i = 0; i < scene.blocks.size(); i++)
        (i < first_of_world ? bytes.objects : scene.blocks[i].instances > 0 ? bytes.instances : bytes.world) += scene.blocks[i].stored_bytes;
    return bytes;
}

uint64_t lights_of_instances(const BakedScene& scene) {
    uint64_t sum = 0;
    for (const rp_instance_traits& traits : scene.instance_traits) sum += traits.light_count;
    return sum;
}

Result<Parts> parts_of_block(const BakedScene& scene, std::span<const std::byte> stored) {
    const auto too_small = [] { return Status::failed("its sections do not fit into it; bake the scene again"); };
    rp_block_header header;
    if (stored.size() < sizeof header) return too_small();
    std::memcpy(&header, stored.data(), sizeof header);
    Parts parts;
    parts.headers = sizeof header;
    parts.nodes = sizeof(rp_node) * uint64_t(header.node_count);
    (holds_instances(header) ? parts.instances : parts.leaves) = leaf_bytes(header);
    if (!good_coding(header, scene.position_cell)) return Status::failed("how its positions and ids are coded makes no sense; bake the scene again");
    parts.vertices = position_bytes(header);
    parts.spheres = sizeof(rp_sphere) * uint64_t(header.sphere_count);
    parts.sphere_ids = sizeof(rp_u32) * uint64_t(header.sphere_count);
    parts.ids = id_bytes(header);
    parts.normals = header.flags & RP_BLOCK_NORMALS ? sizeof(rp_u32) * uint64_t(header.vertex_count) : 0;
    parts.colors = header.flags & RP_BLOCK_COLORS ? sizeof(rp_u32) * uint64_t(header.vertex_count) : 0;
    parts.uvs = RP_BLOCK_HAS_UVS(header.attributes_at) ? sizeof(Float2) * uint64_t(header.vertex_count) : 0;
    if (parts.content() > stored.size()) return too_small();
    parts.padding = stored.size() - parts.content();
    return parts;
}

// Reads every block, and every page of images; their checksums are verified by that. verify: also checks that what is in it holds together.
Result<Parts> read_all_blocks(const BlockFile& file, bool verify) {
    Parts sum;
    InstancedCount instanced(file.scene());
    std::vector<std::byte> stored;
    const auto& blocks = file.scene().blocks;
    for (uint32_t block = 0; block < blocks.size(); ++block) {
        stored.resize(blocks[block].stored_bytes);
        RAYPAGER_TRY(file.read_block(block, stored));
        if (verify) RAYPAGER_TRY(file.check_block(block, stored));
        const auto parts = parts_of_block(file.scene(), stored);
        if (!parts) return parts.status().at(fmt::format("{}: block {}", file.path().string(), block));
        sum.add(*parts);
        instanced.add(block, stored);
    }
    sum.shown_primitives = instanced.primitives();
    stored.resize(RP_TEXTURE_PAGE_BYTES);
    for (uint32_t page = 0; page < file.scene().pages.size(); ++page) RAYPAGER_TRY(file.read_page(page, stored));
    return sum;
}

double share(uint64_t bytes, const Parts& parts) {
    const uint64_t all = parts.content() + parts.padding;
    return all > 0 ? double(bytes) / double(all) : 0;
}

std::string as_json(const std::shared_ptr<const BlockFile>& file, const Parts& parts, bool verified) {
    const BakedScene& scene = file->scene();
    const Blocks blocks(file);
    Json shares = Json::object();
    for (const NamedPart& part : named_parts) shares[part.name] = share(parts.*part.bytes, parts);
    const TopFigures top = top_figures(scene);
    const BytesOf whose = bytes_of(scene);
    return json_text({{"scene", scene_json(blocks, BlockForm::stored)},
                      {"scene_on_cpu", scene_json(blocks, BlockForm::wide)},
                      {"parts", shares},
                      {"top_tree", {{"portals", top.block_entries}, {"nodes", top.nodes}, {"depth", top.depth}}},
                      {"objects", scene.objects.size()},
                      {"instances", scene.instances},
                      {"instance_levels", scene.instance_levels()},
                      {"instanced_primitives", parts.shown_primitives},
                      {"instance_traits", scene.instance_traits.size()},
                      {"lights_of_instances", lights_of_instances(scene)},
                      {"bytes_of", {{"objects", whose.objects}, {"world", whose.world}, {"instances", whose.instances}}},
                      {"bounds", bounds_json(blocks)},
                      {"camera", camera_json(scene.camera, scene.width, scene.height, blocks)},
                      {"position_cell", scene.position_cell},
                      {"lights", scene.lights.size()},
                      {"materials", scene.materials.size()},
                      {"verified", verified}});
}

std::string as_text(const std::shared_ptr<const BlockFile>& file, const Parts& parts, bool verified) {
    const BakedScene& scene = file->scene();
    const TopFigures top = top_figures(scene);
    const uint64_t primitives = scene.triangles + scene.spheres;
    const double bytes_each = primitives > 0 ? double(scene.geometry_bytes(BlockForm::stored)) / double(primitives) : 0;
    std::string text = fmt::format("{}: {}\n", file->path().string(), format_bytes(file->file_bytes()));
    const auto line = [&text](const char* name, const std::string& value) { text += fmt::format("  {:<12} {}\n", name, value); };
    line("primitives", primitives_text(scene.triangles, scene.spheres));
    if (!scene.objects.empty()) {
        const std::string levels = scene.instance_levels() > 1 ? fmt::format(", in each other {} levels deep", scene.instance_levels()) : "";
        line("instances", fmt::format("{} of {}{}", format_count(scene.instances), counted(scene.objects.size(), "object"), levels));
        line("", fmt::format("{} primitives with each as often as it is placed", format_count(parts.shown_primitives)));
        if (!scene.instance_traits.empty())
            line("", fmt::format("with {} of their own, and {} of traits", counted(lights_of_instances(scene), "light"),
                                 counted(scene.instance_traits.size(), "set")));
    }
    line("blocks", fmt::format("{}, {} at most", format_count(scene.blocks.size()), format_bytes(scene.largest_block(BlockForm::stored))));
    const uint64_t wide = scene.geometry_bytes(BlockForm::wide);
    line("geometry", fmt::format("{}, {:.2f} bytes per primitive, in the file and on a GPU", format_bytes(scene.stored_bytes()), bytes_each));
    line("", fmt::format("{}, {:.2f} bytes per primitive, on a CPU", format_bytes(wide), primitives > 0 ? double(wide) / double(primitives) : 0));
    if (!scene.objects.empty()) {
        const BytesOf whose = bytes_of(scene);
        line("", fmt::format("{} of objects, {} of the world's own, {} of instances", format_bytes(whose.objects), format_bytes(whose.world),
                             format_bytes(whose.instances)));
    }
    if (!scene.images.empty())
        line("images", fmt::format("{} in {}, {}", format_count(scene.images.size()), counted(scene.pages.size(), "page"),
                                   format_bytes(scene.texture_bytes())));
    if (scene.has_paged_sky()) {
        const rp_image& sky = scene.images[scene.sky_words[RP_IMAGE_IN_PAGES]];
        const uint32_t whole = scene.sky_words[RP_IMAGE_WIDTH], level = scene.image_levels[sky.first_level + scene.sky_words[RP_IMAGE_LEVEL]].width;
        line("sky", fmt::format("{0} x {0} pixels, the last of the images; {1} x {1} where light is scattered", whole, level));
    }
    if (scene.position_cell > 0)
        line("positions", fmt::format("multiples of {:.6g}: moved by {:.6g} at most along each axis, beyond rounding", scene.position_cell,
                                      scene.position_cell / 2));
    line("top tree",
         fmt::format("{}, {}, depth {}", counted(top.block_entries, "block entry", "block entries"), counted(top.nodes, "node"), top.depth));
    line("shading", fmt::format("{}, {}", counted(scene.materials.size(), "material"), counted(scene.lights.size(), "light")));
    const auto point = [](const float(&p)[3]) { return fmt::format("{},{},{}", p[0], p[1], p[2]); };
    line("bounds", fmt::format("{} to {}", point(scene.lower), point(scene.upper)));
    const std::string camera = camera_string(scene.camera, scene.width, scene.height, center_of(Blocks(file)));
    line("camera", camera.empty() ? "none that --camera could describe: it is no upright perspective with square pixels" : camera);
    line("picture", fmt::format("{}x{}, {} spp, depth {}", scene.width, scene.height, scene.spp, scene.max_depth));
    text += "  share of bytes\n";
    for (const NamedPart& part : named_parts) {
        const uint64_t bytes = parts.*part.bytes;
        const double each = primitives > 0 ? double(bytes) / double(primitives) : 0;
        text += fmt::format("    {:<10} {:>5.1f} %  {:>6.2f} bytes per primitive\n", part.name, 100 * share(bytes, parts), each);
    }
    if (verified)
        text +=
            scene.pages.empty() ? "  every block was read and checked: all is well\n" : "  every block and page was read and checked: all is well\n";
    return text;
}

}  // namespace

Status run_inspect(const Arguments& arguments) {
    std::vector<std::string> names;
    bool json = false, verify = false;
    OptionParser parser(
        "inspect", "FILE.rpb [--json] [--verify]",
        "Says what is in a block file: sizes, bytes per primitive, shares of the parts, figures of the trees, the bounds of what it shows, and "
        "its camera as --camera takes it.");
    parser.inputs("FILE.rpb", 1, 1, names);
    parser.flag("json", "print one JSON object", json);
    parser.flag("verify", "check the contents of every block, not only its checksum; name the first bad one", verify);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};

    const auto file = BlockFile::open(names.front());
    if (!file) return file.status();
    const auto parts = read_all_blocks(**file, verify);
    if (!parts) return parts.status();
    const std::string text = json ? as_json(*file, *parts, verify) : as_text(*file, *parts, verify);
    std::fputs(text.c_str(), stdout);
    return {};
}

}  // namespace raypager
