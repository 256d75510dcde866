#include "import/gltf_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <exception>

#include "base/files.hpp"
#include "import/gltf_meshopt.hpp"
#include "import/text.hpp"

namespace raypager {

// Where the parts of the file lie.
struct GltfContainer {
    GltfModel* model = nullptr;
    const InputFile* file = nullptr;
    const GltfJson* about = nullptr;
    uint64_t chunk_at = 0, chunk_bytes = 0;  // of binary data
    std::vector<std::string> files;
    Status error;  // that tinygltf would put into words of its own
};

namespace {

constexpr uint64_t longest_json = uint64_t{1} << 30;
constexpr uint32_t json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;

uint32_t little_endian(std::span<const std::byte> bytes) {
    uint32_t value = 0;
    for (size_t i = 4; i > 0; --i) value = value << 8 | std::to_integer<uint32_t>(bytes[i - 1]);
    return value;
}

// Reads the JSON, and finds out where the binary data lie. Format: glTF 2.0 specification, section 4 (GLB).
Status read_container(const InputFile& file, GltfContainer& container, std::string& text) {
    const std::string name = file.path().string();
    std::array<std::byte, 12> head{};
    if (file.size() == 0) return Status::failed(name + ": is empty");
    const bool binary = file.size() >= head.size() && file.read(0, head).ok() && std::memcmp(head.data(), "glTF", 4) == 0;
    uint64_t at = 0, bytes = file.size();
    if (binary) {
        if (const uint32_t version = little_endian(std::span(head).subspan(4)); version != 2)
            return Status::failed(fmt::format("{}: is of GLB version {}; version 2 can be read", name, version));
        const uint64_t size = little_endian(std::span(head).subspan(8));
        const auto cut_off = [&] {
            return Status::failed(fmt::format("{}: is damaged or cut off: it says that it has {} bytes, and has {}", name, size, file.size()));
        };
        if (size > file.size()) return cut_off();
        std::array<std::byte, 8> chunk{};
        if (size < head.size() + chunk.size()) return cut_off();
        RAYPAGER_TRY(file.read(head.size(), chunk));
        at = head.size() + chunk.size();
        bytes = little_endian(chunk);
        if (little_endian(std::span(chunk).subspan(4)) != json_chunk || bytes > size - at)
            return Status::failed(name + ": its first part is no JSON that ends inside of the file; it is damaged");
        const uint64_t next = at + bytes;
        if (size - next >= chunk.size()) {
            RAYPAGER_TRY(file.read(next, chunk));
            if (little_endian(std::span(chunk).subspan(4)) == binary_chunk) {
                container.chunk_at = next + chunk.size();
                container.chunk_bytes = little_endian(chunk);
                if (container.chunk_bytes > size - container.chunk_at) return cut_off();
            }
        }
    }
    if (bytes > longest_json) return Status::failed(fmt::format("{}: has {} bytes of JSON; up to {} are read", name, bytes, longest_json));
    text.resize(static_cast<size_t>(bytes));
    RAYPAGER_TRY(file.read(at, std::as_writable_bytes(std::span(text))));
    // Chunks are filled up with blanks; some writers use zeros.
    while (!text.empty() && text.back() == '\0') text.pop_back();
    return {};
}

Status read_buffer(GltfContainer& container, size_t number, std::vector<unsigned char>& out) {
    const GltfBuffer& buffer = container.about->buffers[number];
    if (buffer.place == GltfBuffer::Place::nowhere) {
        out.assign(1, 0);
        return {};
    }
    const auto take = [&](const InputFile& file, uint64_t at) {
        out.resize(static_cast<size_t>(buffer.bytes));
        return file.read(at, std::as_writable_bytes(std::span(out)));
    };
    if (buffer.place == GltfBuffer::Place::chunk) return take(*container.file, container.chunk_at);
    const auto path = container.model->file_of(buffer.uri);
    if (!path) return path.status();
    const auto file = InputFile::open(*path);
    if (!file) return container.model->failed(file.status().message());
    if (file->size() < buffer.bytes)
        return container.model->failed(
            fmt::format("{} has {} bytes, of which it needs {}; one of the two is damaged or cut off", path->string(), file->size(), buffer.bytes));
    container.files.push_back(path->string());
    return take(*file, 0);
}

bool read_buffer_for_tinygltf(std::vector<unsigned char>* out, std::string* error, const std::string& name, void* user) {
    auto& container = *static_cast<GltfContainer*>(user);
    size_t number = 0;
    const auto [end, bad] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (bad != std::errc() || end != name.data() + name.size() || number >= container.about->buffers.size()) return false;
    container.error = read_buffer(container, number, *out);
    if (!container.error.ok()) *error = container.error.message();
    return container.error.ok();
}

// Images in buffers stay there; of those in the JSON the bytes are kept as they are.
bool keep_image(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes, int size, void*) {
    image->as_is = true;
    if (image->bufferView < 0 && size > 0) image->image.assign(bytes, bytes + size);
    return true;
}

std::string first_line(const std::string& text) {
    constexpr size_t longest = 160;
    std::string line = text.substr(0, std::min(text.find('\n'), longest));
    for (char& c : line)
        if (c < ' ' || c > '~') c = '?';
    return line;
}

}  // namespace

Result<std::shared_ptr<const GltfModel>> GltfModel::open(const std::filesystem::path& path) {
    auto model = std::make_shared<GltfModel>();
    model->path_ = path;
    model->name_ = path.string();
    try {
        if (auto status = model->read(); !status.ok()) return status;
    } catch (const std::bad_alloc&) {
        return model->failed("not enough memory to read it");
    } catch (const std::exception& error) {
        return model->failed(fmt::format("cannot be read: {}", first_line(error.what())));
    }
    return std::shared_ptr<const GltfModel>(std::move(model));
}

Status GltfModel::read() {
    const auto file = InputFile::open(path_);
    if (!file) return file.status();
    GltfContainer container;
    container.model = this;
    container.file = &*file;
    container.files = {name_};
    std::string text;
    RAYPAGER_TRY(read_container(*file, container, text));
    auto about = prepare_gltf_json(name_, text, container.chunk_bytes);
    if (!about) return about.status();
    text = {};
    about_ = std::move(*about);
    for (const std::string& extension : about_.required)
        if (!is_known_gltf_extension(extension)) return failed(fmt::format("needs the extension {}, which is not read", clipped(extension)));
    container.about = &about_;
    RAYPAGER_TRY(parse(container));
    files_ = std::move(container.files);
    about_.text = {};
    return unpack_views();
}

Status GltfModel::parse(GltfContainer& container) {
    tinygltf::TinyGLTF reader;
    reader.SetImageLoader(keep_image, nullptr);
    tinygltf::FsCallbacks files{};
    files.FileExists = [](const std::string&, void*) { return true; };
    files.ExpandFilePath = [](const std::string& name, void*) { return name; };
    files.ReadWholeFile = read_buffer_for_tinygltf;
    files.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; };
    files.user_data = &container;
    reader.SetFsCallbacks(files);
    std::string error, warning;
    const bool good = reader.LoadASCIIFromString(&content_, &error, &warning, about_.text.data(), static_cast<unsigned int>(about_.text.size()), "",
                                                 tinygltf::NO_REQUIRE);
    RAYPAGER_TRY(container.error);
    if (!good || !error.empty()) return failed(fmt::format("cannot be read: {}", error.empty() ? "tinygltf gives no reason" : first_line(error)));
    if (content_.buffers.size() != about_.buffers.size()) return failed("some of its buffers cannot be read");
    return {};
}

Status GltfModel::unpack_views() {
    unpacked_.resize(content_.bufferViews.size());
    for (size_t i = 0; i < content_.bufferViews.size(); ++i)
        if (const auto* packed = gltf_extension(content_.bufferViews[i].extensions, "EXT_meshopt_compression")) RAYPAGER_TRY(unpack_view(i, *packed));
    return {};
}

Status GltfModel::unpack_view(size_t number, const tinygltf::Value& packed) {
    const std::string place = fmt::format("buffer view {}", number);
    const auto* buffer = gltf_item(content_.buffers, gltf_index(&packed, "buffer"));
    const int64_t offset = gltf_member(&packed, "byteOffset") ? gltf_index(&packed, "byteOffset") : 0, bytes = gltf_index(&packed, "byteLength");
    if (!buffer || offset < 0 || bytes <= 0 || static_cast<uint64_t>(offset) > buffer->data.size() ||
        static_cast<uint64_t>(bytes) > buffer->data.size() - static_cast<uint64_t>(offset))
        return failed(place + ": its packed bytes lie outside of their buffer; the file is damaged");
    const auto source = std::as_bytes(std::span(buffer->data)).subspan(static_cast<size_t>(offset), static_cast<size_t>(bytes));
    const MeshoptView view{gltf_text(&packed, "mode"), gltf_text(&packed, "filter"), gltf_index(&packed, "count"), gltf_index(&packed, "byteStride")};
    auto result = unpack_meshopt(view, source);
    if (!result) return result.status().at(name_ + ": " + place);
    unpacked_[number] = std::move(*result);
    return {};
}

Result<std::span<const std::byte>> GltfModel::view(int64_t number) const {
    const auto* view = gltf_item(content_.bufferViews, number);
    if (!view) return failed(fmt::format("there is no buffer view {}; the file is damaged", number));
    if (unpacked_[static_cast<size_t>(number)]) return std::span<const std::byte>(*unpacked_[static_cast<size_t>(number)]);
    const auto* buffer = gltf_item(content_.buffers, view->buffer);
    if (!buffer) return failed(fmt::format("buffer view {} is of buffer {}, which there is not; the file is damaged", number, view->buffer));
    if (view->byteOffset > buffer->data.size() || view->byteLength > buffer->data.size() - view->byteOffset)
        return failed(fmt::format("buffer view {} goes beyond its buffer; the file is damaged or cut off", number));
    return std::as_bytes(std::span(buffer->data)).subspan(view->byteOffset, view->byteLength);
}

uint64_t GltfModel::buffer_bytes() const {
    uint64_t bytes = 0;
    for (const auto& buffer : content_.buffers) bytes += buffer.data.size();
    return bytes;
}

// RFC 3986, as far as files beside this one need it.
Result<std::filesystem::path> GltfModel::file_of(const std::string& uri) const {
    std::string text;
    for (size_t i = 0; i < uri.size(); ++i) {
        unsigned value = 0;
        const char* digits = uri.data() + i + 1;
        if (uri[i] == '%' && i + 2 < uri.size() && std::from_chars(digits, digits + 2, value, 16).ptr == digits + 2) {
            text += static_cast<char>(value);
            i += 2;
        } else {
            text += uri[i] == '\\' ? '/' : uri[i];
        }
    }
    const std::filesystem::path path(text);
    const bool outside = path.is_absolute() || std::find(path.begin(), path.end(), "..") != path.end();
    const bool elsewhere = text.find(':') < text.find('/');
    if (text.empty() || text.find('\0') != std::string::npos || outside || elsewhere)
        return failed(fmt::format("names \"{}\", which is no file in its folder or below; put it there", clipped(text)));
    return path_.parent_path() / path;
}

const tinygltf::Value* gltf_extension(const tinygltf::ExtensionMap& extensions, const char* name) {
    const auto found = extensions.find(name);
    return found != extensions.end() && found->second.IsObject() ? &found->second : nullptr;
}

const tinygltf::Value* gltf_member(const tinygltf::Value* object, const char* name) {
    return object && object->Has(name) ? &object->Get(name) : nullptr;
}

double gltf_number(const tinygltf::Value* object, const char* name, double otherwise) {
    const auto* value = gltf_member(object, name);
    return value && value->IsNumber() ? value->GetNumberAsDouble() : otherwise;
}

int64_t gltf_index(const tinygltf::Value* object, const char* name) {
    const auto* value = gltf_member(object, name);
    return value && value->IsInt() ? value->GetNumberAsInt() : -1;
}

std::vector<double> gltf_numbers(const tinygltf::Value* object, const char* name) {
    std::vector<double> numbers;
    const auto* value = gltf_member(object, name);
    for (size_t i = 0; value && i < value->ArrayLen(); ++i) {
        const auto& item = value->Get(static_cast<int>(i));
        numbers.push_back(item.IsNumber() ? item.GetNumberAsDouble() : 0);
    }
    return numbers;
}

std::string gltf_text(const tinygltf::Value* object, const char* name) {
    const auto* value = gltf_member(object, name);
    return value && value->IsString() ? value->Get<std::string>() : std::string();
}

}  // namespace raypager
