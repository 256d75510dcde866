// Numbers of a glTF file, as accessors describe them: checked against the bytes that are there before any of them is read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "import/gltf_model.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// REQUIRES: the model lives as long.
class GltfAccessor {
public:
    // components: how many numbers an element must have, from..to. Sparse ones are read, too; those without bytes are zeros.
    static Result<GltfAccessor> open(const GltfModel& model, int64_t number, uint32_t from, uint32_t to);

    uint64_t count() const { return count_; }
    uint32_t components() const { return components_; }
    bool is_integer() const;  // of 8, 16 or 32 bits, unsigned, and no fractions
    bool is_real() const;     // floats, or fractions in integers
    bool is_signed() const;
    uint64_t bytes() const { return count_ * element_bytes_; }
    // REQUIRES: element < count(), component < components(). Fractions in integers are from 0, or -1, to 1.
    double number(uint64_t element, uint32_t component) const;
    uint32_t index(uint64_t element) const;  // REQUIRES: is_integer()
    Float3 vector(uint64_t element) const;   // REQUIRES: components() >= 3

private:
    const std::byte* element(uint64_t number) const;
    Status open_sparse(const GltfModel& model, const tinygltf::Accessor& accessor, const std::string& place);

    std::span<const std::byte> bytes_, sparse_values_;
    std::vector<uint32_t> sparse_;  // elements that have other values, in ascending order
    uint64_t count_ = 0, stride_ = 0, element_bytes_ = 0;
    uint32_t components_ = 0;
    int type_ = 0;
    bool fractions_ = false;
};

}  // namespace raypager
