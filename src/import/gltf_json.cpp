#include "import/gltf_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>

#include "import/text.hpp"

namespace raypager {
namespace {

using nlohmann::json;

constexpr int deepest_json = 64;  // glTF itself needs a dozen
constexpr std::string_view octets = "data:application/octet-stream;base64,";

// Those that are read. Others are said to be left out.
constexpr std::array known_extensions = {"EXT_mesh_gpu_instancing",
                                         "EXT_meshopt_compression",
                                         "EXT_texture_webp",
                                         "KHR_draco_mesh_compression",
                                         "KHR_lights_punctual",
                                         "KHR_materials_clearcoat",
                                         "KHR_materials_emissive_strength",
                                         "KHR_materials_ior",
                                         "KHR_materials_pbrSpecularGlossiness",
                                         "KHR_materials_specular",
                                         "KHR_materials_transmission",
                                         "KHR_materials_unlit",
                                         "KHR_materials_volume",
                                         "KHR_mesh_quantization",
                                         "KHR_texture_transform"};

bool is_known(std::string_view extension) { return std::find(known_extensions.begin(), known_extensions.end(), extension) != known_extensions.end(); }

bool is_too_deep(std::string_view text) {
    int depth = 0;
    bool quoted = false;
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quoted && c == '\\')
            ++i;
        else if (c == '"')
            quoted = !quoted;
        else if (!quoted && (c == '{' || c == '[') && ++depth > deepest_json)
            return true;
        else if (!quoted && (c == '}' || c == ']'))
            --depth;
    }
    return false;
}

// Leaves out what nobody reads.
void make_smaller(json& value) {
    if (value.is_object()) {
        value.erase("extras");
        if (const auto found = value.find("extensions"); found != value.end() && found->is_object())
            for (auto it = found->begin(); it != found->end();) it = is_known(it.key()) ? std::next(it) : found->erase(it);
    }
    if (value.is_structured())
        for (json& part : value) make_smaller(part);
}

std::vector<std::string> strings_of(const json& document, const char* member) {
    std::vector<std::string> strings;
    if (const auto found = document.find(member); found != document.end() && found->is_array())
        for (const json& part : *found)
            if (part.is_string()) strings.push_back(part.get<std::string>());
    return strings;
}

std::optional<uint64_t> whole_number(const json& object, const char* member) {
    const auto found = object.find(member);
    return found != object.end() && found->is_number_unsigned() ? std::optional(found->get<uint64_t>()) : std::nullopt;
}

std::string text_of(const json& object, const char* member) {
    const auto found = object.find(member);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

json* extension_of(json& object, const char* extension) {
    const auto all = object.find("extensions");
    if (all == object.end() || !all->is_object()) return nullptr;
    const auto found = all->find(extension);
    return found != all->end() && found->is_object() ? &*found : nullptr;
}

class Preparation {
public:
    Preparation(const std::string& name, uint64_t chunk_bytes) : name_(name), chunk_bytes_(chunk_bytes) {}

    Result<GltfJson> prepare(std::string_view text) {
        if (is_too_deep(text)) return failed(fmt::format("its JSON is nested more than {} deep; no glTF file needs that", deepest_json));
        try {
            document_ = json::parse(text);
        } catch (const json::parse_error& error) {
            return failed(fmt::format("its JSON makes no sense at byte {} of {}; it is damaged or cut off", error.byte, text.size()));
        } catch (const json::exception&) {
            return failed("its JSON has numbers that are too large; it is damaged");
        }
        if (auto status = check_version(); !status.ok()) return status;
        out_.used = strings_of(document_, "extensionsUsed");
        out_.required = strings_of(document_, "extensionsRequired");
        out_.generator = text_of(document_["asset"], "generator");
        const auto animations = document_.find("animations");
        out_.has_animations = animations != document_.end() && animations->is_array() && !animations->empty();
        document_.erase("animations");
        make_smaller(document_);
        for (const char* list : {"buffers", "bufferViews", "images", "meshes"})
            if (document_.contains(list) && !document_[list].is_array()) return failed(fmt::format("its \"{}\" are no list; it is damaged", list));
        if (auto status = place_buffers(); !status.ok()) return status;
        if (auto status = place_images(); !status.ok()) return status;
        hide_draco_indices();
        complete_skins();
        out_.text = document_.dump();
        return std::move(out_);
    }

private:
    Status failed(const std::string& what) const { return Status::failed(name_ + ": " + what); }

    Status check_version() const {
        if (!document_.is_object() || !document_.contains("asset") || !document_["asset"].is_object())
            return failed("is no glTF file: it has no \"asset\" with a version");
        const std::string version = text_of(document_["asset"], "version");
        if (!version.starts_with("2.")) return failed(fmt::format("is of glTF version \"{}\"; version 2 can be read", clipped(version)));
        return {};
    }

    // Any kind of data in text, as the one that tinygltf knows.
    static bool is_in_text(json& object, const std::string& uri) {
        constexpr std::string_view base64 = ";base64,";
        if (!uri.starts_with("data:")) return false;
        const size_t end = uri.find(base64);
        if (end != std::string::npos) object["uri"] = std::string(octets) + uri.substr(end + base64.size());
        return end != std::string::npos;
    }

    Status place_buffers() {
        if (!document_.contains("buffers")) return {};
        for (json& object : document_["buffers"]) {
            const size_t number = out_.buffers.size();
            const auto bytes = object.is_object() ? whole_number(object, "byteLength") : std::nullopt;
            if (!bytes || *bytes == 0) return failed(fmt::format("buffer {} does not say how long it is; the file is damaged", number));
            GltfBuffer buffer{GltfBuffer::Place::text, text_of(object, "uri"), *bytes};
            if (buffer.uri.empty()) {
                const bool in_chunk = number == 0 && chunk_bytes_ > 0;
                if (!in_chunk && !extension_of(object, "EXT_meshopt_compression"))
                    return failed(fmt::format("buffer {} is neither in this file nor in another; it is damaged", number));
                buffer.place = in_chunk ? GltfBuffer::Place::chunk : GltfBuffer::Place::nowhere;
                if (in_chunk && *bytes > chunk_bytes_)
                    return failed(
                        fmt::format("buffer {} has {} bytes, but the file holds {}; it is damaged or cut off", number, *bytes, chunk_bytes_));
                if (!in_chunk) object["byteLength"] = 1;
            } else if (!is_in_text(object, buffer.uri)) {
                buffer.place = GltfBuffer::Place::file;
            }
            if (buffer.place == GltfBuffer::Place::text)
                buffer.uri.clear();
            else
                object["uri"] = std::to_string(number);
            out_.buffers.push_back(std::move(buffer));
        }
        return {};
    }

    // tinygltf takes the address of their first byte.
    Status place_images() {
        if (!document_.contains("images")) return {};
        size_t number = 0;
        for (json& image : document_["images"]) {
            if (!image.is_object()) return failed(fmt::format("image {} is no object; the file is damaged", number));
            is_in_text(image, text_of(image, "uri"));
            if (image.contains("bufferView") && !lies_in_buffer(image))
                return failed(fmt::format("image {} lies outside of its buffer; the file is damaged or cut off", number));
            ++number;
        }
        return {};
    }

    bool lies_in_buffer(const json& image) const {
        const auto view_number = whole_number(image, "bufferView");
        const auto views = document_.find("bufferViews");
        if (!view_number || views == document_.end() || *view_number >= views->size()) return false;
        const json& view = (*views)[*view_number];
        if (!view.is_object()) return false;
        const auto buffer = whole_number(view, "buffer"), bytes = whole_number(view, "byteLength");
        const uint64_t offset = whole_number(view, "byteOffset").value_or(0);
        if (!buffer || !bytes || *bytes == 0 || *buffer >= out_.buffers.size()) return false;
        const GltfBuffer& place = out_.buffers[*buffer];
        return place.place != GltfBuffer::Place::nowhere && offset < place.bytes && *bytes <= place.bytes - offset;
    }

    // Their accessors have no bytes, which tinygltf does not accept; what Draco has packed says itself what is a triangle.
    void hide_draco_indices() {
        if (!document_.contains("meshes")) return;
        for (json& mesh : document_["meshes"]) {
            const auto primitives = mesh.is_object() ? mesh.find("primitives") : mesh.end();
            if (!mesh.is_object() || primitives == mesh.end() || !primitives->is_array()) continue;
            for (json& primitive : *primitives)
                if (primitive.is_object() && extension_of(primitive, "KHR_draco_mesh_compression")) primitive.erase("indices");
        }
    }

    // tinygltf takes for an error what the specification leaves open.
    void complete_skins() {
        if (!document_.contains("skins") || !document_["skins"].is_array()) return;
        for (json& skin : document_["skins"])
            if (skin.is_object() && !skin.contains("inverseBindMatrices")) skin["inverseBindMatrices"] = -1;
    }

    const std::string& name_;
    const uint64_t chunk_bytes_;
    json document_;
    GltfJson out_;
};

}  // namespace

Result<GltfJson> prepare_gltf_json(const std::string& name, std::string_view text, uint64_t chunk_bytes) {
    return Preparation(name, chunk_bytes).prepare(text);
}

bool is_known_gltf_extension(std::string_view extension) { return is_known(extension); }

}  // namespace raypager
