#include "import/gltf_accessor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace raypager {
namespace {

// Elements without any bytes, which sparse ones replace: so many, or as many as there are bytes in the file.
constexpr uint64_t most_zeros = uint64_t{1} << 16;
constexpr std::array<std::byte, 64> zeros{};

template <class T>
T load(const std::byte* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
}

// Where `count` elements lie that begin at `offset`.
bool are_inside(uint64_t bytes, uint64_t offset, uint64_t count, uint64_t stride, uint64_t element_bytes) {
    if (count == 0) return true;
    if (offset > bytes || element_bytes > bytes - offset) return false;
    return count - 1 <= (bytes - offset - element_bytes) / stride;
}

}  // namespace

Result<GltfAccessor> GltfAccessor::open(const GltfModel& model, int64_t number, uint32_t from, uint32_t to) {
    const std::string place = fmt::format("accessor {}", number);
    const auto wrong = [&](const std::string& what) { return model.failed(fmt::format("{} {}; the file is damaged", place, what)); };
    const auto* accessor = gltf_item(model.content().accessors, number);
    if (!accessor) return model.failed(fmt::format("there is no {}; the file is damaged", place));
    GltfAccessor result;
    const int size = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(accessor->componentType));
    const int components = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor->type));
    if (size <= 0 || size > 4 || accessor->componentType == TINYGLTF_COMPONENT_TYPE_INT) return wrong("has numbers of an unknown type");
    if (components < static_cast<int>(from) || components > static_cast<int>(to))
        return wrong(fmt::format("has {} numbers in each element, where {} to {} are needed", components, from, to));
    if (accessor->count >= RP_NONE) return wrong(fmt::format("has {} elements, more than can be counted", accessor->count));
    result.type_ = accessor->componentType;
    result.components_ = static_cast<uint32_t>(components);
    result.count_ = accessor->count;
    result.fractions_ = accessor->normalized;
    result.element_bytes_ = result.stride_ = static_cast<uint64_t>(size) * result.components_;
    if (accessor->bufferView >= 0) {
        const auto bytes = model.view(accessor->bufferView);
        if (!bytes) return bytes.status();
        const uint64_t stride = model.content().bufferViews[static_cast<size_t>(accessor->bufferView)].byteStride;
        if (stride > 0) result.stride_ = stride;
        if (result.stride_ < result.element_bytes_) return wrong(fmt::format("has elements that overlap, {} bytes apart", stride));
        if (!are_inside(bytes->size(), accessor->byteOffset, result.count_, result.stride_, result.element_bytes_))
            return wrong(fmt::format("has {} elements, of which not all lie in the {} bytes of its buffer view", result.count_, bytes->size()));
        result.bytes_ = bytes->subspan(std::min<uint64_t>(accessor->byteOffset, bytes->size()));
    } else if (result.count_ > std::max(most_zeros, model.buffer_bytes())) {
        return wrong(fmt::format("has {} elements, but no bytes", result.count_));
    }
    if (accessor->sparse.isSparse)
        if (auto status = result.open_sparse(model, *accessor, place); !status.ok()) return status;
    return result;
}

Status GltfAccessor::open_sparse(const GltfModel& model, const tinygltf::Accessor& accessor, const std::string& place) {
    const auto wrong = [&](const char* what) { return model.failed(fmt::format("sparse {} {}; the file is damaged", place, what)); };
    const auto& sparse = accessor.sparse;
    const int index_bytes = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(sparse.indices.componentType));
    const bool known = sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                       sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                       sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    if (sparse.count < 0 || static_cast<uint64_t>(sparse.count) > count_ || !known) return wrong("has no sound number of elements");
    const auto count = static_cast<uint64_t>(sparse.count), each = static_cast<uint64_t>(index_bytes);
    const auto indices = model.view(sparse.indices.bufferView), values = model.view(sparse.values.bufferView);
    if (!indices) return indices.status();
    if (!values) return values.status();
    if (sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0) return wrong("lies in front of its buffer view");
    const auto first = static_cast<size_t>(sparse.indices.byteOffset), first_value = static_cast<size_t>(sparse.values.byteOffset);
    if (!are_inside(indices->size(), first, count, each, each) || !are_inside(values->size(), first_value, count, element_bytes_, element_bytes_))
        return wrong("goes beyond its buffer views");
    if (count == 0) return {};
    sparse_values_ = values->subspan(first_value);
    sparse_.reserve(static_cast<size_t>(count));
    for (uint64_t i = 0; i < count; ++i) {
        const std::byte* at = indices->data() + first + i * each;
        const uint32_t index = each == 1 ? load<uint8_t>(at) : each == 2 ? load<uint16_t>(at) : load<uint32_t>(at);
        if (index >= count_ || (!sparse_.empty() && index <= sparse_.back())) return wrong("names elements that there are not, or not in order");
        sparse_.push_back(index);
    }
    return {};
}

bool GltfAccessor::is_integer() const {
    return !fractions_ && (type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                           type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT);
}
bool GltfAccessor::is_real() const { return fractions_ || type_ == TINYGLTF_COMPONENT_TYPE_FLOAT; }
bool GltfAccessor::is_signed() const {
    return type_ == TINYGLTF_COMPONENT_TYPE_BYTE || type_ == TINYGLTF_COMPONENT_TYPE_SHORT || type_ == TINYGLTF_COMPONENT_TYPE_FLOAT;
}

const std::byte* GltfAccessor::element(uint64_t number) const {
    if (!sparse_.empty()) {
        const auto found = std::lower_bound(sparse_.begin(), sparse_.end(), number);
        if (found != sparse_.end() && *found == number)
            return sparse_values_.data() + static_cast<uint64_t>(found - sparse_.begin()) * element_bytes_;
    }
    return bytes_.empty() ? zeros.data() : bytes_.data() + number * stride_;
}

double GltfAccessor::number(uint64_t number, uint32_t component) const {
    const std::byte* at = element(number);
    switch (type_) {
        case TINYGLTF_COMPONENT_TYPE_BYTE: {
            const double value = load<int8_t>(at + component);
            return fractions_ ? std::max(value / 127, -1.0) : value;
        }
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: {
            const double value = load<uint8_t>(at + component);
            return fractions_ ? value / 255 : value;
        }
        case TINYGLTF_COMPONENT_TYPE_SHORT: {
            const double value = load<int16_t>(at + 2 * component);
            return fractions_ ? std::max(value / 32767, -1.0) : value;
        }
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
            const double value = load<uint16_t>(at + 2 * component);
            return fractions_ ? value / 65535 : value;
        }
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: {
            const double value = load<uint32_t>(at + 4 * component);
            return fractions_ ? value / 4294967295.0 : value;
        }
        default:
            return load<float>(at + 4 * component);
    }
}

uint32_t GltfAccessor::index(uint64_t number) const {
    const std::byte* at = element(number);
    return type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? load<uint8_t>(at)
           : type_ == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? load<uint16_t>(at)
                                                             : load<uint32_t>(at);
}

Float3 GltfAccessor::vector(uint64_t number) const {
    if (type_ == TINYGLTF_COMPONENT_TYPE_FLOAT) {
        const std::byte* at = element(number);
        return {load<float>(at), load<float>(at + 4), load<float>(at + 8)};
    }
    return {static_cast<float>(this->number(number, 0)), static_cast<float>(this->number(number, 1)), static_cast<float>(this->number(number, 2))};
}

}  // namespace raypager
