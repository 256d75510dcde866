// glTF files for tests.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "unit/import_files.hpp"

namespace raypager::test {

// Bytes as a uri that holds them.
inline std::string to_data_uri(const std::string& bytes) {
    constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text = "data:application/octet-stream;base64,";
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63];
    }
    return text;
}

// Collects what buffers hold; the rest of the JSON is said by the test.
class GltfWriter {
public:
    // Returns the number of the buffer view.
    int view(const std::string& bytes, const std::string& members = "") {
        while (bytes_.size() % 4) bytes_ += '\0';
        views_.push_back("{\"buffer\":0,\"byteOffset\":" + std::to_string(bytes_.size()) + ",\"byteLength\":" + std::to_string(bytes.size()) +
                         members + "}");
        bytes_ += bytes;
        return static_cast<int>(views_.size()) - 1;
    }
    // Of this JSON; returns the number of the accessor.
    int accessor(const std::string& members) {
        accessors_.push_back("{" + members + "}");
        return static_cast<int>(accessors_.size()) - 1;
    }
    int accessor(const std::string& bytes, int component_type, const char* type, size_t count, const std::string& members = "") {
        return accessor("\"bufferView\":" + std::to_string(view(bytes)) + ",\"componentType\":" + std::to_string(component_type) + ",\"type\":\"" +
                        type + "\",\"count\":" + std::to_string(count) + members);
    }
    int vectors(const std::vector<Float3>& values) {
        std::string bytes;
        for (const Float3& v : values) bytes += bytes_of(v.x) + bytes_of(v.y) + bytes_of(v.z);
        return accessor(bytes, 5126, "VEC3", values.size());
    }
    int pairs(const std::vector<Float2>& values) {
        std::string bytes;
        for (const Float2& v : values) bytes += bytes_of(v.x) + bytes_of(v.y);
        return accessor(bytes, 5126, "VEC2", values.size());
    }
    int indices(const std::vector<uint16_t>& values) {
        std::string bytes;
        for (const uint16_t v : values) bytes += bytes_of(v);
        return accessor(bytes, 5123, "SCALAR", values.size());
    }

    // rest: members of the file beside asset, buffers, views and accessors.
    std::string json(const std::string& rest, const std::string& uri = "") const {
        const auto list = [](const std::vector<std::string>& items) {
            std::string text;
            for (const std::string& item : items) text += (text.empty() ? "" : ",") + item;
            return text;
        };
        std::string text = "{\"asset\":{\"version\":\"2.0\"},";
        if (!bytes_.empty()) {
            text += "\"buffers\":[{\"byteLength\":" + std::to_string(bytes_.size()) + (uri.empty() ? "" : ",\"uri\":\"" + uri + "\"") + "}" +
                    buffers_ + "],";
            text += "\"bufferViews\":[" + list(views_) + "],";
        }
        if (!accessors_.empty()) text += "\"accessors\":[" + list(accessors_) + "],";
        return text + rest + "}";
    }
    std::string glb(const std::string& rest) const {
        std::string text = json(rest), bytes = bytes_;
        while (text.size() % 4) text += ' ';
        while (bytes.size() % 4) bytes += '\0';
        const std::string body = chunk(text, 0x4e4f534a) + (bytes.empty() ? "" : chunk(bytes, 0x004e4942));
        return "glTF" + bytes_of(uint32_t{2}) + bytes_of(static_cast<uint32_t>(12 + body.size())) + body;
    }
    const std::string& bytes() const { return bytes_; }
    void add_buffer(const std::string& object) { buffers_ += "," + object; }

private:
    static std::string chunk(const std::string& content, uint32_t type) {
        return bytes_of(static_cast<uint32_t>(content.size())) + bytes_of(type) + content;
    }
    std::string bytes_, buffers_;
    std::vector<std::string> views_, accessors_;
};

// One mesh of one primitive, in one node. attributes: beside the position; primitive, node: more members of these.
inline std::string gltf_scene_of(int positions, const std::string& attributes = "", const std::string& primitive = "", const std::string& node = "",
                                 const std::string& rest = "") {
    return "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0" + node +
           "}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":" + std::to_string(positions) + attributes + "}" + primitive + "}]}]" +
           rest;
}

// A square in the plane z = 0 that faces +z, as two triangles of four vertices; u to the right, v downwards.
struct GltfSquare {
    GltfWriter file;
    int positions = file.vectors({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    int normals = file.vectors({{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}});
    int uvs = file.pairs({{0, 1}, {1, 1}, {1, 0}, {0, 0}});
    int corners = file.indices({0, 1, 2, 0, 2, 3});
    std::string scene(const std::string& primitive = "", const std::string& node = "", const std::string& rest = "") const {
        return gltf_scene_of(positions, ",\"NORMAL\":" + std::to_string(normals) + ",\"TEXCOORD_0\":" + std::to_string(uvs),
                             ",\"indices\":" + std::to_string(corners) + primitive, node, rest);
    }
};

}  // namespace raypager::test
