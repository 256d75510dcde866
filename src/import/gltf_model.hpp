// A glTF file and its buffers in memory, as tinygltf reads them. Numbers in a model may be anything: whoever follows one checks it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "import/gltf_json.hpp"
#include "import/gltf_tiny.hpp"
#include "raypager/status.hpp"

namespace raypager {

class GltfModel {
public:
    // Text (.gltf) or binary (.glb), whatever the file is called. Buffers are read, too; images in other files are not.
    static Result<std::shared_ptr<const GltfModel>> open(const std::filesystem::path& path);

    const std::string& name() const { return name_; }
    const std::filesystem::path& path() const { return path_; }
    const tinygltf::Model& content() const { return content_; }
    const GltfJson& about() const { return about_; }
    const std::vector<std::string>& files() const { return files_; }  // it itself and those of its buffers
    // The bytes of a buffer view, unpacked.
    Result<std::span<const std::byte>> view(int64_t number) const;
    uint64_t buffer_bytes() const;  // of all buffers
    // The file beside this one that a uri names.
    Result<std::filesystem::path> file_of(const std::string& uri) const;
    Status failed(const std::string& what) const { return Status::failed(name_ + ": " + what); }

private:
    Status read();
    Status parse(struct GltfContainer& container);
    Status unpack_views();
    Status unpack_view(size_t number, const tinygltf::Value& packed);

    std::filesystem::path path_;
    std::string name_;
    GltfJson about_;
    tinygltf::Model content_;
    std::vector<std::string> files_;
    std::vector<std::optional<std::vector<std::byte>>> unpacked_;  // by view
};

// Of a list that a model has; null if there is none of this number.
template <class T>
const T* gltf_item(const std::vector<T>& items, int64_t number) {
    return number >= 0 && static_cast<uint64_t>(number) < items.size() ? &items[static_cast<size_t>(number)] : nullptr;
}

// Members of an object in an extension, null where there are none.
const tinygltf::Value* gltf_extension(const tinygltf::ExtensionMap& extensions, const char* name);
const tinygltf::Value* gltf_member(const tinygltf::Value* object, const char* name);
double gltf_number(const tinygltf::Value* object, const char* name, double otherwise);
int64_t gltf_index(const tinygltf::Value* object, const char* name);  // -1: none
std::vector<double> gltf_numbers(const tinygltf::Value* object, const char* name);
std::string gltf_text(const tinygltf::Value* object, const char* name);

}  // namespace raypager
