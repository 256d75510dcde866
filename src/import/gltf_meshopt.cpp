#include "import/gltf_meshopt.hpp"

#include <fmt/format.h>

#include "import/text.hpp"

#ifdef RAYPAGER_MESHOPT
#include <meshoptimizer.h>
#endif

namespace raypager {

#ifdef RAYPAGER_MESHOPT
namespace {

// The most that a byte can stand for: 16 of a vertex buffer are packed into two bits where they are alike. More is a damaged file.
constexpr uint64_t most_packed = 128;

bool unpack_into(const MeshoptView& view, std::span<const std::byte> packed, std::vector<std::byte>& out) {
    const auto count = static_cast<size_t>(view.count), stride = static_cast<size_t>(view.stride);
    const auto* bytes = reinterpret_cast<const unsigned char*>(packed.data());
    if (view.mode == "ATTRIBUTES") return meshopt_decodeVertexBuffer(out.data(), count, stride, bytes, packed.size()) == 0;
    if (view.mode == "TRIANGLES") return meshopt_decodeIndexBuffer(out.data(), count, stride, bytes, packed.size()) == 0;
    return meshopt_decodeIndexSequence(out.data(), count, stride, bytes, packed.size()) == 0;
}

bool fits(const MeshoptView& view) {
    if (view.count <= 0 || view.stride <= 0) return false;
    if (view.mode == "ATTRIBUTES") return view.stride % 4 == 0 && view.stride <= 256;
    const bool indices = view.stride == 2 || view.stride == 4;
    return indices && (view.mode == "INDICES" || (view.mode == "TRIANGLES" && view.count % 3 == 0));
}

bool filter(const MeshoptView& view, std::vector<std::byte>& out) {
    const auto count = static_cast<size_t>(view.count), stride = static_cast<size_t>(view.stride);
    if (view.filter.empty() || view.filter == "NONE") return true;
    if (view.mode != "ATTRIBUTES") return false;
    if (view.filter == "OCTAHEDRAL" && (stride == 4 || stride == 8))
        meshopt_decodeFilterOct(out.data(), count, stride);
    else if (view.filter == "QUATERNION" && stride == 8)
        meshopt_decodeFilterQuat(out.data(), count, stride);
    else if (view.filter == "EXPONENTIAL")
        meshopt_decodeFilterExp(out.data(), count, stride);
    else
        return false;
    return true;
}

}  // namespace

Result<std::vector<std::byte>> unpack_meshopt(const MeshoptView& view, std::span<const std::byte> packed) {
    const auto wrong = [&](const char* what) {
        return Status::failed(fmt::format("{} (mode {}, filter {}, {} elements of {} bytes); the file is damaged", what, clipped(view.mode),
                                          clipped(view.filter.empty() ? "NONE" : view.filter), view.count, view.stride));
    };
    if (!fits(view)) return wrong("it is packed in no way that EXT_meshopt_compression has");
    const uint64_t bytes = static_cast<uint64_t>(view.count) * static_cast<uint64_t>(view.stride);
    if (bytes / most_packed > packed.size()) return wrong("its packed bytes cannot hold so much");
    std::vector<std::byte> out(static_cast<size_t>(bytes));
    if (!unpack_into(view, packed, out)) return wrong("it cannot be unpacked");
    if (!filter(view, out)) return wrong("its filter is not one that such bytes can have");
    return out;
}
#else
Result<std::vector<std::byte>> unpack_meshopt(const MeshoptView&, std::span<const std::byte>) {
    return Status::failed("is packed by meshoptimizer (EXT_meshopt_compression), which this build is without; build with libmeshoptimizer-dev");
}
#endif

}  // namespace raypager
