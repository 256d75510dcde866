#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/huge_pages.hpp"
#include "base/parallel.hpp"
#include "import/ply_mesh.hpp"
#include "import/text.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// Reads a file front to back in large pieces.
class ByteStream {
public:
    ByteStream(const InputFile& file, uint64_t offset) : file_(file), offset_(offset) {}
    uint64_t left() const { return file_.size() - position(); }
    uint64_t position() const { return offset_ - (end_ - at_); }
    // Goes on elsewhere.
    void move_to(uint64_t position) {
        offset_ = position;
        at_ = end_ = 0;
    }
    // Makes the next count bytes available at data(). REQUIRES: count <= piece.
    Status need(size_t count) { return end_ - at_ >= count ? Status() : refill(count); }
    const InputFile& file() const { return file_; }
    const std::byte* data() const { return buffer_.data() + at_; }
    void skip(size_t count) { at_ += count; }
    static constexpr size_t piece = size_t{4} << 20;

private:
    Status refill(size_t count) {
        // No more than the file can fill: small files are many.
        buffer_.resize(std::max(buffer_.size(), static_cast<size_t>(std::clamp<uint64_t>(left(), count, piece))));
        std::copy(buffer_.begin() + static_cast<ptrdiff_t>(at_), buffer_.begin() + static_cast<ptrdiff_t>(end_), buffer_.begin());
        end_ -= at_;
        at_ = 0;
        const size_t more = static_cast<size_t>(std::min<uint64_t>(piece - end_, file_.size() - offset_));
        // Too few bytes: let the read fail, its message says where the file ends.
        RAYPAGER_TRY(file_.read(offset_, std::span(buffer_).subspan(end_, std::max(more, count - std::min(count, end_)))));
        end_ += more;
        offset_ += more;
        return {};
    }

    const InputFile& file_;
    uint64_t offset_;
    std::vector<std::byte> buffer_;
    size_t at_ = 0, end_ = 0;
};

float load_float(const std::byte* from, PlyType type, bool swap) {
    return type == PlyType::float32 ? load_ply<float>(from, swap) : static_cast<float>(load_ply_number(from, type, swap));
}

int64_t load_integer(const std::byte* from, PlyType type, bool swap) {
    switch (type) {
        case PlyType::int8:
            return load_ply<int8_t>(from, swap);
        case PlyType::uint8:
            return load_ply<uint8_t>(from, swap);
        case PlyType::int16:
            return load_ply<int16_t>(from, swap);
        case PlyType::uint16:
            return load_ply<uint16_t>(from, swap);
        case PlyType::int32:
            return load_ply<int32_t>(from, swap);
        case PlyType::uint32:
            return load_ply<uint32_t>(from, swap);
        default:
            return -1;  // not whole: no index
    }
}

class BinaryReader {
public:
    // sink: gets the mesh piece by piece; if there is none, the whole is left in mesh(). REQUIRES, with a sink: layout.in_pieces().
    BinaryReader(const InputFile& file, const PlyHeader& header, const PlyLayout& layout, const MeshView& view, MeshSink* sink, MeshIssues& issues)
        : stream_(file, header.bytes),
          name_(file.path().string()),
          header_(header),
          layout_(layout),
          view_(view),
          moved_(view.origin != std::array<double, 3>{0, 0, 0}),
          sink_(sink),
          issues_(issues),
          out_(layout, view, issues),
          mesh_(out_.mesh()),
          swap_(header.encoding == PlyEncoding::big_endian) {}

    Status read() {
        // The header's counts have been checked against the file's size.
        const uint64_t faces = layout_.faces ? layout_.faces->count : 0;
        if (sink_) RAYPAGER_TRY(sink_->expect(layout_.vertices->count, faces));
        reserve_huge(mesh_.positions, room(layout_.vertices->count));
        if (layout_.normal) reserve_huge(mesh_.normals, room(layout_.vertices->count));
        if (layout_.vertex_color) reserve_huge(mesh_.colors, room(layout_.vertices->count));
        if (layout_.uv) reserve_huge(mesh_.uvs, room(layout_.vertices->count));
        reserve_huge(mesh_.triangles, room(faces));
        for (const PlyElement& element : header_.elements) {
            if (&element == layout_.vertices && !element.has_list())
                RAYPAGER_TRY(plain_vertices(element));
            else if (&element == layout_.faces && is_index_list(element) && !view_.faces)
                RAYPAGER_TRY(plain_faces(element));
            else
                for (uint64_t i = 0; i < element.count; ++i) RAYPAGER_TRY(item(element));
            RAYPAGER_TRY(hand_on());
        }
        RAYPAGER_TRY(look_behind());
        if (!sink_) out_.finish();
        return {};
    }

    TriangleMesh& mesh() { return mesh_; }

private:
    static constexpr size_t piece = size_t{1} << 16;  // vertices or triangles that are handed on at a time
    size_t room(uint64_t count) const { return static_cast<size_t>(sink_ ? std::min<uint64_t>(count, piece) : count); }

    // What follows the last element says nothing; more than a line end should not be there.
    Status look_behind() {
        if (stream_.left() == 0) return {};
        std::vector<std::byte> rest(static_cast<size_t>(std::min<uint64_t>(stream_.left(), 4)));
        RAYPAGER_TRY(stream_.file().read(stream_.position(), rest));
        const bool blank = std::all_of(rest.begin(), rest.end(), [](std::byte b) { return is_blank(static_cast<char>(b)); });
        if (!blank || rest.size() > 3)
            issues_.warn("ply tail", fmt::format("{}: {} {} the last element; header and data may not match", name_, stream_.left(),
                                                 stream_.left() == 1 ? "byte follows" : "bytes follow"));
        return {};
    }

    // Gives what has come to the sink.
    Status hand_on() {
        if (!sink_) return {};
        if (out_.polygons().any_to_cut()) RAYPAGER_TRY(cut_polygons());
        if (!mesh_.positions.empty()) RAYPAGER_TRY(sink_->vertices({mesh_.positions, mesh_.normals, mesh_.colors, mesh_.uvs}));
        if (!mesh_.triangles.empty()) RAYPAGER_TRY(sink_->triangles(mesh_.triangles));
        mesh_.positions.clear();
        mesh_.normals.clear();
        mesh_.colors.clear();
        mesh_.uvs.clear();
        mesh_.triangles.clear();
        return {};
    }
    Status hand_on_if_many() { return sink_ && std::max(mesh_.positions.size(), mesh_.triangles.size()) >= piece ? hand_on() : Status(); }

    // Polygons whose vertices have been handed on already: these are read again, in order.
    Status cut_polygons() {
        std::vector<uint32_t> numbers = out_.polygons().vertices_to_cut();
        std::sort(numbers.begin(), numbers.end());
        numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
        while (!numbers.empty() && numbers.back() >= layout_.vertices->count) numbers.pop_back();
        std::vector<Vector> places(numbers.size());
        std::vector<std::byte> bytes;
        constexpr uint32_t widest_gap = 32;
        for (size_t first = 0; first < numbers.size();) {
            size_t end = first + 1;
            while (end < numbers.size() && numbers[end] - numbers[end - 1] <= widest_gap && numbers[end] - numbers[first] < piece) ++end;
            bytes.resize((size_t{numbers[end - 1]} - numbers[first] + 1) * stride_);
            RAYPAGER_TRY(stream_.file().read(vertices_at_ + numbers[first] * stride_, bytes));
            for (size_t i = first; i < end; ++i)
                for (size_t a = 0; a < 3; ++a) {
                    const size_t p = layout_.position[a];
                    places[i][a] = load_ply_number(bytes.data() + (numbers[i] - numbers[first]) * stride_ + offsets_[p],
                                                   layout_.vertices->properties[p].type, swap_) -
                                   view_.origin[a];
                }
            first = end;
        }
        out_.polygons().cut_concave([&](uint32_t vertex, Vector& place) {
            const auto found = std::lower_bound(numbers.begin(), numbers.end(), vertex);
            if (found == numbers.end() || *found != vertex) return false;
            place = places[static_cast<size_t>(found - numbers.begin())];
            return std::isfinite(place[0]) && std::isfinite(place[1]) && std::isfinite(place[2]);
        });
        return {};
    }

    static bool is_index_list(const PlyElement& element) { return element.properties.size() == 1 && ply_type_bytes(element.properties[0].type) == 4; }

    // Items that may be read at a time by all threads, in the memory that the sink allows; 0: too few for it to be worth it.
    uint64_t max_at_once(size_t stride, size_t decoded_bytes) const {
        constexpr uint64_t max_bytes = uint64_t{64} << 20;
        if (helping_workers() < 2) return 0;
        const uint64_t items = (sink_ ? std::min(sink_->buffer_bytes(), max_bytes) : max_bytes / 4) / (stride + decoded_bytes);
        return items < 2 * piece ? 0 : items;
    }

    // Reads items of stride bytes by all threads, a wave of them after the other: room(n) is asked for n more, decode(bytes, first, n) decodes n of
    // them from number `first` of the wave on and returns how many it could before one that it could not, which ends it, and keep(n)
    // hears how many of the wave came before that. Returns how many came in all, of at most so many.
    template <class Room, class Decode, class Keep>
    Result<uint64_t> in_waves(size_t stride, size_t decoded_bytes, uint64_t most, const Room& room, const Decode& decode, const Keep& keep) {
        most = std::min(most, stream_.left() / stride);
        uint64_t done = 0;
        // Not many at first: it may end soon.
        for (uint64_t wave = 2 * piece;; wave *= 2) {
            wave = std::min(wave, max_at_once(stride, decoded_bytes));
            const auto count = static_cast<size_t>(std::min(most - done, wave));
            if (count == 0) return done;
            const uint64_t begin = stream_.position();
            const size_t each = (count + 4 * helping_workers() - 1) / (4 * helping_workers());
            struct Piece {
                size_t decoded = 0;
                Status status;
            };
            std::vector<Piece> pieces((count + each - 1) / each);
            room(count);
            parallel_for(count, each, [&](size_t first, size_t end) {
                Piece& mine = pieces[first / each];
                std::vector<std::byte> bytes((end - first) * stride);
                mine.status = stream_.file().read(begin + first * stride, bytes);
                if (mine.status.ok()) mine.decoded = decode(bytes.data(), first, end - first);
            });
            size_t good = 0;
            for (size_t i = 0; i < pieces.size() && good == i * each; i++) {
                RAYPAGER_TRY(pieces[i].status);
                good += pieces[i].decoded;
            }
            keep(good);
            RAYPAGER_TRY(hand_on());
            stream_.move_to(begin + good * stride);
            done += good;
            if (good < count) return done;
        }
    }

    // Faces that are nothing but a list of 32-bit indices, and nearly all of them triangles, are most of most files.
    Status plain_faces(const PlyElement& element) {
        const PlyProperty& property = element.properties[0];
        const size_t count_bytes = ply_type_bytes(*property.count_type), bytes = count_bytes + 3 * sizeof(uint32_t);
        const bool is_signed = property.type == PlyType::int32;
        const auto is_triangle = [&](const std::byte* face) { return load_integer(face, *property.count_type, swap_) == 3; };
        const auto triangle = [&](const std::byte* face) {
            const auto index = [&](size_t k) { return load_ply<uint32_t>(face + count_bytes + 4 * k, swap_); };
            // As a signed number it would be negative: no vertex has this number.
            const auto known = [](uint32_t v) { return v >> 31 ? RP_NONE : v; };
            const Triangle t = {index(0), index(1), index(2)};
            return is_signed ? Triangle{known(t[0]), known(t[1]), known(t[2])} : t;
        };
        const auto next_is_triangle = [&] { return stream_.left() >= bytes && stream_.need(bytes).ok() && is_triangle(stream_.data()); };
        uint64_t alone = piece;  // faces that are read one at a time before many are tried again: the more, the more often that was in vain
        for (uint64_t i = 0; i < element.count;) {
            if (element.count - i > piece && next_is_triangle()) {
                RAYPAGER_TRY(hand_on());
                size_t base = 0;
                const auto done = in_waves(
                    bytes, sizeof(Triangle), element.count - i,
                    [&](size_t count) {
                        base = mesh_.triangles.size();
                        mesh_.triangles.resize(base + count);
                    },
                    [&](const std::byte* face, size_t first, size_t count) {
                        size_t k = 0;
                        for (; k < count && is_triangle(face + k * bytes); k++) mesh_.triangles[base + first + k] = triangle(face + k * bytes);
                        return k;
                    },
                    [&](size_t count) { mesh_.triangles.resize(base + count); });
                if (!done) return done.status();
                i += *done;
                alone = *done > alone ? piece : 2 * alone;
            }
            // One at a time, up to where it may be worth it again.
            for (const uint64_t end = std::min(element.count, i + alone); i < end; ++i) {
                if (stream_.left() >= bytes) {
                    RAYPAGER_TRY(stream_.need(bytes));
                    if (is_triangle(stream_.data())) {
                        mesh_.triangles.push_back(triangle(stream_.data()));
                        stream_.skip(bytes);
                        RAYPAGER_TRY(hand_on_if_many());
                        continue;
                    }
                }
                RAYPAGER_TRY(item(element));
            }
        }
        return {};
    }

    // Vertices without lists have a fixed size: many at a time.
    Status plain_vertices(const PlyElement& element) {
        vertices_at_ = stream_.position();
        for (const PlyProperty& p : element.properties) {
            offsets_.push_back(stride_);
            stride_ += ply_type_bytes(p.type);
        }
        const size_t stride = stride_;
        if (stride > ByteStream::piece) return Status::failed(name_ + ": a vertex has too many properties");
        const auto vector = [&](const std::byte* vertex, const size_t(&properties)[3]) {
            const auto value = [&](size_t p) { return load_float(vertex + offsets_[p], element.properties[p].type, swap_); };
            return Float3{value(properties[0]), value(properties[1]), value(properties[2])};
        };
        const auto moved_position = [&](const std::byte* vertex) {
            const auto value = [&](size_t axis) {
                const size_t p = layout_.position[axis];
                return static_cast<float>(load_ply_number(vertex + offsets_[p], element.properties[p].type, swap_) - view_.origin[axis]);
            };
            return Float3{value(0), value(1), value(2)};
        };
        const auto place = [&](const std::byte* vertex, size_t at) {
            mesh_.positions[at] = moved_ ? moved_position(vertex) : vector(vertex, layout_.position);
            if (layout_.normal) mesh_.normals[at] = vector(vertex, {(*layout_.normal)[0], (*layout_.normal)[1], (*layout_.normal)[2]});
            if (layout_.vertex_color) mesh_.colors[at] = color(element, vertex);
            if (!layout_.uv) return;
            const auto coordinate = [&](size_t p) { return load_float(vertex + offsets_[p], element.properties[p].type, swap_); };
            mesh_.uvs[at] = {coordinate((*layout_.uv)[0]), coordinate((*layout_.uv)[1])};
        };
        size_t base = 0;
        const auto resize = [&](size_t count) {
            mesh_.positions.resize(base + count);
            if (layout_.normal) mesh_.normals.resize(base + count);
            if (layout_.vertex_color) mesh_.colors.resize(base + count);
            if (layout_.uv) mesh_.uvs.resize(base + count);
        };
        const auto room = [&](size_t count) {
            base = mesh_.positions.size();
            resize(count);
        };
        const auto done = in_waves(
            stride, 2 * sizeof(Float3) + sizeof(uint32_t) + (layout_.uv ? sizeof(Float2) : 0), element.count, room,
            [&](const std::byte* vertices, size_t first, size_t count) {
                for (size_t k = 0; k < count; k++) place(vertices + k * stride, base + first + k);
                return count;
            },
            resize);
        if (!done) return done.status();
        for (uint64_t i = *done; i < element.count; ++i) {
            RAYPAGER_TRY(stream_.need(stride));
            room(1);
            place(stream_.data(), base);
            stream_.skip(stride);
            RAYPAGER_TRY(hand_on_if_many());
        }
        return {};
    }

    uint32_t color(const PlyElement& element, const std::byte* vertex) const {
        const auto& properties = *layout_.vertex_color;
        const auto byte = [&](size_t i) { return static_cast<uint32_t>(vertex[offsets_[properties[i]]]); };
        const auto is_byte = [&](size_t i) { return element.properties[properties[i]].type == PlyType::uint8; };
        if (is_byte(0) && is_byte(1) && is_byte(2)) return byte(0) | byte(1) << 8 | byte(2) << 16;
        const auto primary = [&](size_t i) {
            return load_ply_number(vertex + offsets_[properties[i]], element.properties[properties[i]].type, swap_) / view_.color_scale;
        };
        return pack_color(primary(0), primary(1), primary(2));
    }

    Status item(const PlyElement& element) {
        RAYPAGER_TRY(out_.read_item(element, *this));
        return hand_on_if_many();
    }

public:
    // What PlyMesh asks for.
    Status number(PlyType type, double& value) {
        RAYPAGER_TRY(stream_.need(ply_type_bytes(type)));
        value = load_ply_number(stream_.data(), type, swap_);
        stream_.skip(ply_type_bytes(type));
        return {};
    }
    Status index(PlyType type, int64_t& value) {
        RAYPAGER_TRY(stream_.need(ply_type_bytes(type)));
        value = load_integer(stream_.data(), type, swap_);
        stream_.skip(ply_type_bytes(type));
        return {};
    }
    Status length(PlyType count_type, PlyType type, uint64_t& value) {
        int64_t count = 0;
        RAYPAGER_TRY(index(count_type, count));
        if (count < 0 || static_cast<uint64_t>(count) > stream_.left() / ply_type_bytes(type))
            return Status::failed(
                fmt::format("{}: a list of {} values does not fit into the {} bytes that are left; the file is truncated or damaged", name_, count,
                            stream_.left()));
        value = static_cast<uint64_t>(count);
        return {};
    }
    Status skip(PlyType type, uint64_t count) {
        const uint64_t bytes = count * ply_type_bytes(type);
        if (bytes > stream_.left()) return stream_.need(ByteStream::piece);  // fails, and says where the file ends
        if (bytes > ByteStream::piece) {
            stream_.move_to(stream_.position() + bytes);
            return {};
        }
        RAYPAGER_TRY(stream_.need(static_cast<size_t>(bytes)));
        stream_.skip(static_cast<size_t>(bytes));
        return {};
    }

private:
    ByteStream stream_;
    std::string name_;
    const PlyHeader& header_;
    const PlyLayout& layout_;
    const MeshView view_;
    const bool moved_;  // the view's origin is another
    MeshSink* const sink_;
    MeshIssues& issues_;
    PlyMesh out_;
    TriangleMesh& mesh_;  // of out_: what was not handed on
    const bool swap_;
    uint64_t vertices_at_ = 0;     // in the file, if they have a fixed size
    size_t stride_ = 0;            // of these
    std::vector<size_t> offsets_;  // of their properties
};

}  // namespace

Status read_ply_binary(const InputFile& file, const PlyHeader& header, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues) {
    const auto layout = find_ply_layout(header, file.path().string(), view.uvs);
    if (!layout) return layout.status();
    BinaryReader reader(file, header, *layout, view, nullptr, issues);
    RAYPAGER_TRY(reader.read());
    mesh = std::move(reader.mesh());
    return {};
}

Status stream_ply_binary(const InputFile& file, const PlyHeader& header, const MeshView& view, MeshSink& sink, MeshIssues& issues) {
    const auto layout = find_ply_layout(header, file.path().string(), view.uvs);
    if (!layout) return layout.status();
    if (layout->in_pieces()) return BinaryReader(file, header, *layout, view, &sink, issues).read();
    // There is no way around having it all.
    BinaryReader reader(file, header, *layout, view, nullptr, issues);
    RAYPAGER_TRY(reader.read());
    const TriangleMesh& mesh = reader.mesh();
    RAYPAGER_TRY(sink.vertices(vertices_of(mesh)));
    return sink.triangles(mesh.triangles);
}

}  // namespace raypager
