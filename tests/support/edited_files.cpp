#include "support/edited_files.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "base/hash.hpp"
#include "block/block_coding.hpp"
#include "render/checkpoint_format.hpp"
#include "store/format.hpp"
#include "support/block_file_bytes.hpp"

namespace raypager::support {
namespace {

struct Edit {
    uint8_t place, how;
    uint16_t item, field;
    uint16_t other;  // the item that a value is taken from, or how many
    uint32_t value;
};
static_assert(sizeof(Edit) == edit_bytes);

// Equal items, one after the other.
struct Items {
    std::span<std::byte> bytes;
    size_t item_bytes = 0;
    size_t count() const { return item_bytes > 0 ? bytes.size() / item_bytes : 0; }
    std::span<std::byte> item(size_t number) const { return bytes.subspan(number % count() * item_bytes, item_bytes); }
};

Items items_of(std::string& bytes, uint64_t at, uint64_t count, uint64_t item_bytes) {
    if (at > bytes.size() || item_bytes == 0) return {};
    const uint64_t fits = std::min(count, (bytes.size() - at) / item_bytes);
    return {std::as_writable_bytes(std::span(bytes)).subspan(at, fits * item_bytes), item_bytes};
}

template <class T>
T load(std::span<const std::byte> bytes) {
    T value = {};
    std::memcpy(&value, bytes.data(), std::min(bytes.size(), sizeof value));
    return value;
}
template <class T>
void store(std::span<std::byte> bytes, const T& value) {
    std::memcpy(bytes.data(), &value, std::min(bytes.size(), sizeof value));
}

uint32_t special(uint32_t which) {
    constexpr float largest = std::numeric_limits<float>::max(), smallest = std::numeric_limits<float>::denorm_min();
    constexpr std::array values = {0u,
                                   1u,
                                   2u,
                                   0x7fffffffu,
                                   0x80000000u,
                                   0xffffffffu,
                                   0xfffffffeu,
                                   0xc0000000u,
                                   0x7f800000u,
                                   0xff800000u /* infinite */,
                                   0x7fc00000u,
                                   0xffc00001u /* no number */,
                                   std::bit_cast<uint32_t>(largest),
                                   std::bit_cast<uint32_t>(-largest),
                                   std::bit_cast<uint32_t>(smallest),
                                   std::bit_cast<uint32_t>(1e-30f),
                                   std::bit_cast<uint32_t>(1e30f),
                                   std::bit_cast<uint32_t>(1.0f),
                                   std::bit_cast<uint32_t>(-1.0f),
                                   0x0000ffffu,
                                   0xffff0000u,
                                   0x00010000u,
                                   63u,
                                   64u,
                                   65u,
                                   255u,
                                   256u};
    return values[which % values.size()];
}

uint32_t changed(uint32_t old, const Edit& edit, uint32_t elsewhere) {
    switch (edit.how % 10) {
        case 0:
            return edit.value;
        case 1:
            return special(edit.value);
        case 2:
            return old + 1;
        case 3:
            return old - 1;
        case 4:
            return old + edit.value % 64 - 32;
        case 5:
            return old ^ 1u << edit.value % 32;
        case 6:
            return elsewhere;
        case 7:  // as a number
            return std::bit_cast<uint32_t>(std::ldexp(std::bit_cast<float>(old), static_cast<int>(edit.value % 64) - 32));
        case 8:
            return std::bit_cast<uint32_t>(-std::bit_cast<float>(old));
        default:
            return edit.value % 1024;
    }
}

// One word, or where items are smaller what they have.
void edit_word(const Items& items, const Edit& edit) {
    if (items.count() == 0) return;
    const size_t words = std::max<size_t>(1, items.item_bytes / sizeof(uint32_t)), at = edit.field % words * sizeof(uint32_t);
    const auto place = items.item(edit.item).subspan(at);
    store(place, changed(load<uint32_t>(place), edit, load<uint32_t>(items.item(edit.other).subspan(at))));
}

class BlockFileEditor {
public:
    explicit BlockFileEditor(std::string& bytes) : bytes_(bytes), header_(load<format::Header>(std::as_bytes(std::span(bytes)))) {}

    void apply(const Edit& edit) {
        constexpr uint32_t sections = format::section_count;
        // Sections are what half of all places are: blocks have the rest, and what stands in several places.
        const uint32_t place = edit.place % (2 * sections);
        if (place < sections) return edit_word(section(place), edit);
        switch (place - sections) {
            case 0:
                return edit_word({std::as_writable_bytes(std::span(header_.sections)), sizeof(format::SectionEntry)}, edit);
            case 1:
                return resize(edit);
            case 2:
                return swap(edit);
            case 3:
                return set_bounds(edit);
            case 4:
                return set_grid(edit);
            case 5:
                return move_probability(edit);
            case 6:
                return edit_word(image_page(edit), edit);
            case 7:
                return set_counts(edit);
            default:
                return edit_block(place - sections - 8, edit);
        }
    }

    // Sizes and checksums are right again.
    void seal() {
        header_.file_bytes = bytes_.size();
        store(std::as_writable_bytes(std::span(bytes_)), header_);
        seal_block_file(bytes_);
    }

private:
    Items section(uint32_t kind) const {
        const format::SectionEntry& entry = header_.sections[kind];
        return items_of(bytes_, entry.offset, entry.count, format::item_bytes[kind]);
    }

    Items block(uint32_t number) const {
        const Items records = section(format::blocks);
        if (records.count() == 0) return {};
        const auto record = load<BlockRecord>(records.item(number));
        return items_of(bytes_, record.offset, 1, record.stored_bytes);
    }

    Items image_page(const Edit& edit) const {
        const Items records = section(format::pages);
        if (records.count() == 0) return {};
        return items_of(bytes_, load<PageRecord>(records.item(edit.item)).offset, RP_TEXTURE_PAGE_BYTES / 4, 4);
    }

    // Part of a block: its header, nodes, leaves, positions, spheres, ids or attributes.
    void edit_block(uint32_t part, const Edit& edit) {
        const Items whole = block(edit.other);
        if (whole.count() == 0 || whole.item_bytes < sizeof(rp_block_header)) return;
        const auto header = load<rp_block_header>(whole.bytes);
        const auto items = [&](uint64_t at, uint64_t count, uint64_t item_bytes) -> Items {
            if (at > whole.bytes.size()) return {};
            return {whole.bytes.subspan(at, std::min(count, (whole.bytes.size() - at) / item_bytes) * item_bytes), item_bytes};
        };
        const uint64_t attributes = RP_BLOCK_ATTRIBUTES_AT(header.attributes_at);
        switch (part % 7) {
            case 0:
                return edit_word(items(0, 1, sizeof header), edit);
            case 1:
                return edit_word(items(header.nodes_at, header.node_count, sizeof(rp_node)), edit);
            case 2:
                return edit_word(holds_instances(header) ? items(header.leaves_at, header.leaf_count, sizeof(rp_instance))
                                                         : items(header.leaves_at, header.leaf_count, sizeof(rp_leaf)),
                                 edit);
            case 3:
                return edit_word(items(header.vertices_at, uint64_t{header.vertex_count} * 3, 4), edit);
            case 4:
                return edit_word(items(header.spheres_at, header.sphere_count, sizeof(rp_sphere)), edit);
            case 5:
                // Of spheres and instances they lie behind these.
                if (holds_instances(header))
                    return edit_word(items(header.leaves_at + header.leaf_count * uint64_t{sizeof(rp_instance)}, header.leaf_count, 4), edit);
                return edit_word(header.sphere_count > 0 && edit.field % 2 == 0
                                     ? items(header.spheres_at + header.sphere_count * uint64_t{sizeof(rp_sphere)}, header.sphere_count, 4)
                                     : items(header.ids_at, header.leaf_count * uint64_t{4}, 4),
                                 edit);
            default:
                return edit_word(items(attributes, attributes > 0 ? whole.bytes.size() / 4 : 0, 4), edit);
        }
    }

    // A section with an item less or more, at the end of the file.
    void resize(const Edit& edit) {
        const uint32_t kind = edit.field % format::section_count;
        const Items old = section(kind);
        if (old.count() == 0) return;
        std::string content(reinterpret_cast<const char*>(old.bytes.data()), old.bytes.size());
        const size_t at = edit.item % old.count() * old.item_bytes;
        if (edit.how % 2 == 0)
            content.erase(at, old.item_bytes);
        else
            content.insert(at, content.substr(edit.other % old.count() * old.item_bytes, old.item_bytes));
        bytes_.resize((bytes_.size() + format::page - 1) / format::page * format::page);
        header_.sections[kind].offset = bytes_.size();
        header_.sections[kind].count = content.size() / old.item_bytes;
        bytes_ += content;
    }

    void swap(const Edit& edit) {
        const Items items = section(edit.field % format::section_count);
        if (items.count() == 0 || edit.item % items.count() == edit.other % items.count()) return;
        std::ranges::swap_ranges(items.item(edit.item), items.item(edit.other));
    }

    // Changes the same of a block in its header and in the table of blocks.
    void set_bounds(const Edit& edit) {
        const Items records = section(format::blocks), whole = block(edit.item);
        if (whole.count() == 0 || whole.item_bytes < sizeof(rp_block_header)) return;
        auto record = load<BlockRecord>(records.item(edit.item));
        auto header = load<rp_block_header>(whole.bytes);
        const size_t axis = edit.field % 3;
        float& bound = edit.field % 6 < 3 ? record.lower[axis] : record.upper[axis];
        bound = std::bit_cast<float>(changed(std::bit_cast<uint32_t>(bound), edit, 0));
        (edit.field % 6 < 3 ? header.lower : header.upper)[axis] = bound;
        store(records.item(edit.item), record);
        store(whole.bytes, header);
    }

    // The same of a grid, which all block entries of the block have, too.
    void set_grid(const Edit& edit) {
        const Items whole = block(edit.item), entries = section(format::block_entries);
        if (whole.count() == 0 || whole.item_bytes < sizeof(rp_block_header)) return;
        auto header = load<rp_block_header>(whole.bytes);
        const size_t axis = edit.field % 3;
        float& value = edit.field % 6 < 3 ? header.origin[axis] : header.cell[axis];
        value = std::bit_cast<float>(changed(std::bit_cast<uint32_t>(value), edit, 0));
        store(whole.bytes, header);
        for (size_t i = 0; i < entries.count(); i++) {
            auto entry = load<rp_block_entry>(entries.item(i));
            if (entry.block != edit.item % section(format::blocks).count()) continue;
            (edit.field % 6 < 3 ? entry.origin : entry.cell)[axis] = value;
            store(entries.item(i), entry);
        }
    }

    // From one light to another: they still sum up to 1.
    void move_probability(const Edit& edit) {
        const Items lights = section(format::lights);
        if (lights.count() < 2 || edit.item % lights.count() == edit.other % lights.count()) return;
        auto from = load<rp_light>(lights.item(edit.item)), to = load<rp_light>(lights.item(edit.other));
        const float moved = from.probability * static_cast<float>(edit.value % 1000) / 1000;
        from.probability -= moved;
        to.probability += moved;
        store(lights.item(edit.item), from);
        store(lights.item(edit.other), to);
    }

    // How many primitives or instances a block has, and with it the scene.
    void set_counts(const Edit& edit) {
        const Items records = section(format::blocks), scene = section(format::scalars), whole = block(edit.item);
        if (whole.count() == 0 || whole.item_bytes < sizeof(rp_block_header) || scene.count() == 0) return;
        auto record = load<BlockRecord>(records.item(edit.item));
        auto header = load<rp_block_header>(whole.bytes);
        auto all = load<format::Scalars>(scene.item(0));
        const auto set = [&](auto& in_record, rp_u32& in_block, uint64_t& in_scene) {
            const auto count = changed(in_record, edit, load<uint32_t>(records.item(edit.other)));
            in_scene += uint64_t{count} - in_record;
            in_record = in_block = count;
        };
        if (holds_instances(header))
            set(record.instances, header.leaf_count, all.instances);
        else if (edit.field % 2 == 0)
            set(record.triangles, header.triangle_count, all.triangles);
        else
            set(record.spheres, header.sphere_count, all.spheres);
        store(records.item(edit.item), record);
        store(whole.bytes, header);
        store(scene.item(0), all);
    }

    std::string& bytes_;
    format::Header header_;
};

class CheckpointEditor {
public:
    explicit CheckpointEditor(std::string& bytes) : bytes_(bytes), header_(load<Header>(std::as_bytes(std::span(bytes)))) {
        gaps_ = bytes_.substr(checkpoint_format::page, header_.gap_count * sizeof(SampleRange));
        samples_ = bytes_.substr(checkpoint_format::samples_offset(header_.gap_count), header_.sample_count * sizeof(rp_path_sample));
        film_ = bytes_.substr(checkpoint_format::film_offset(header_.gap_count, header_.sample_count), header_.film_words * sizeof(uint32_t));
    }

    void apply(const Edit& edit) {
        const auto words = [](std::string& of, size_t item_bytes) { return items_of(of, 0, of.size() / item_bytes, item_bytes); };
        switch (edit.place % 8) {
            case 0:
            case 1:
                // Behind magic and version, up to the checksum.
                return edit_word({std::as_writable_bytes(std::span(&header_, 1)).subspan(24, offsetof(Header, checksum) - 24), 4}, edit);
            case 2:
                return edit_word(words(gaps_, sizeof(SampleRange)), edit);
            case 3:
                return edit_word(words(samples_, sizeof(rp_path_sample)), edit);
            case 4:
                return edit_word(words(film_, 4), edit);
            case 5:
                return resize(samples_, sizeof(rp_path_sample), edit);
            case 6:
                return resize(gaps_, sizeof(SampleRange), edit);
            default:
                return move_sample(edit);
        }
    }

    void seal() {
        if (!absurd_) {
            header_.gap_count = gaps_.size() / sizeof(SampleRange);
            header_.sample_count = samples_.size() / sizeof(rp_path_sample);
            header_.film_words = film_.size() / sizeof(uint32_t);
        }
        header_.gaps_checksum = hash64(std::string_view(gaps_));
        header_.samples_checksum = hash64(std::string_view(samples_));
        header_.film_checksum = hash64(std::string_view(film_));
        bytes_.resize(checkpoint_format::page);
        bytes_ += gaps_ + samples_;
        bytes_.resize((bytes_.size() + checkpoint_format::page - 1) / checkpoint_format::page * checkpoint_format::page);
        bytes_ += film_;
        header_.file_bytes = bytes_.size();
        header_.checksum = hash64(std::as_bytes(std::span(&header_, 1)).first(offsetof(Header, checksum)));
        store(std::as_writable_bytes(std::span(bytes_)), header_);
    }

private:
    using Header = checkpoint_format::Header;

    void resize(std::string& items, size_t item_bytes, const Edit& edit) {
        const size_t count = items.size() / item_bytes;
        if (edit.how % 4 == 3) {  // what the header says is absurd instead
            absurd_ = true;
            (item_bytes == sizeof(SampleRange) ? header_.gap_count : header_.sample_count) = uint64_t{edit.value} << edit.other % 40;
        } else if (edit.how % 4 == 0 && count > 0) {
            items.erase(edit.item % count * item_bytes, item_bytes);
        } else {
            std::string item(item_bytes, '\0');
            if (count > 0) item = items.substr(edit.other % count * item_bytes, item_bytes);
            items.insert(count > 0 ? edit.item % count * item_bytes : 0, item);
        }
    }

    // From those under way to those not begun, or the other way: what was begun still adds up.
    void move_sample(const Edit& edit) {
        if (edit.how % 2 == 0 && !samples_.empty()) {
            samples_.resize(samples_.size() - sizeof(rp_path_sample));
            header_.next_sample--;
        } else {
            const rp_path_sample sample = {edit.value, edit.item};
            samples_.append(reinterpret_cast<const char*>(&sample), sizeof sample);
            header_.next_sample++;
        }
    }

    std::string& bytes_;
    Header header_;
    std::string gaps_, samples_, film_;
    bool absurd_ = false;
};

template <class Editor>
void apply(std::string& bytes, std::string_view edits) {
    Editor editor(bytes);
    for (; edits.size() >= edit_bytes; edits.remove_prefix(edit_bytes)) {
        Edit edit;
        std::memcpy(&edit, edits.data(), sizeof edit);
        editor.apply(edit);
    }
    editor.seal();
}

}  // namespace

void edit_block_file(std::string& bytes, std::string_view edits) { apply<BlockFileEditor>(bytes, edits); }
void edit_checkpoint(std::string& bytes, std::string_view edits) { apply<CheckpointEditor>(bytes, edits); }

std::string random_edits(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::string edits;
    for (size_t i = 0; i < edit_bytes * (1 + seed % 4); i++) edits += static_cast<char>(random());
    return edits;
}

}  // namespace raypager::support
