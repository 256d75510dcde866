// A scene that one process has opened, in all that render it together.
#include <cstring>
#include <string>

#include "raypager/blocks.hpp"
#include "raypager/peers.hpp"
#include "store/block_file.hpp"
#include "store/scene_sections.hpp"

namespace raypager {
namespace {

// In front of the path and the scene.
struct HandedOut {
    uint64_t checksum, path_bytes;
};

Result<std::vector<std::byte>> pack(const BlockSource& source) {
    const BlockSource::Origin origin = source.origin();
    const std::string path = origin.file.string();
    const HandedOut head = {origin.checksum, path.size()};
    auto scene = scene_bytes(source.scene());
    if (!scene) return scene.status();
    std::vector<std::byte> bytes(sizeof head + path.size() + scene->size());
    std::memcpy(bytes.data(), &head, sizeof head);
    std::memcpy(bytes.data() + sizeof head, path.data(), path.size());
    std::memcpy(bytes.data() + sizeof head + path.size(), scene->data(), scene->size());
    return bytes;
}

Result<Blocks> unpack(std::span<const std::byte> bytes) {
    HandedOut head = {};
    if (bytes.size() < sizeof head) return Status::failed("rank 0 has handed out no scene");
    std::memcpy(&head, bytes.data(), sizeof head);
    bytes = bytes.subspan(sizeof head);
    if (head.path_bytes > bytes.size()) return Status::failed("rank 0 has handed out no scene");
    const std::string path(reinterpret_cast<const char*>(bytes.data()), head.path_bytes);
    auto scene = scene_from_bytes(bytes.subspan(head.path_bytes));
    if (!scene) return scene.status();
    return Blocks(BlockFile::of_origin(std::move(*scene), {path, head.checksum}));
}

}  // namespace

Result<Blocks> Blocks::hand_out(const std::optional<Blocks>& own, Peers& peers) {
    std::vector<std::byte> bytes;
    if (peers.rank() == 0) {
        auto packed = own ? pack(own->source()) : Status::failed("rank 0 has no scene to hand out");
        if (!packed) return packed.status();
        bytes = std::move(*packed);
    }
    RAYPAGER_TRY(peers.broadcast(bytes));
    return peers.rank() == 0 ? Result<Blocks>(*own) : unpack(bytes);
}

}  // namespace raypager
