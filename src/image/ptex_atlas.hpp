// The faces of a Ptex file side by side in one image, as which they are baked and looked up.
#pragma once

#include <memory>
#include <vector>

#include "image/ptex_file.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Faces lie along a Morton curve, the largest first and those of a size in their order, each at a multiple of its size: so in levels of the image,
// too, a face has texels of its own down to a single one, and beyond that shares them with faces of neighbouring numbers.
class PtexAtlas final : public ImageSource {
public:
    // An error where the faces together are larger than an image can be.
    static Result<std::shared_ptr<const PtexAtlas>> create(std::shared_ptr<const PtexFile> file, const ImageEncoding& encoding);

    std::string name() const override { return file_->path().string(); }
    Result<ImageShape> shape() const override { return shape_; }
    // Holds a band of the image in memory, as high as the largest face.
    Status read(const std::function<Status(std::span<const std::byte> rows)>& take) const override;
    Result<uint64_t> fingerprint() const override;

    // Where a place of a face lies on the image, in [0, 1]^2, from its top left; u, v: in [0, 1]. The middles of the outermost texels are the edges
    // of the face, so that texels of others are not mixed in. What is no face of the file is face 0.
    Float2 place(uint64_t face, double u, double v) const;
    // Whether all faces of both have the same places.
    bool lies_like(const PtexAtlas& other) const {
        return spots_ == other.spots_ && shape_.width == other.shape_.width && shape_.height == other.shape_.height;
    }

private:
    struct Spot {
        uint32_t x = 0, y = 0;
        uint8_t log_width = 0, log_height = 0;
        bool turned = false;  // u goes down and v to the right
        bool operator==(const Spot&) const = default;
    };
    PtexAtlas(std::shared_ptr<const PtexFile> file, const ImageEncoding& encoding) : file_(std::move(file)), encoding_(encoding) {}
    StoredTexels stored() const;
    Status put_face(uint32_t face, uint32_t first_row, std::vector<std::byte>& band) const;

    const std::shared_ptr<const PtexFile> file_;
    const ImageEncoding encoding_;
    std::vector<Spot> spots_;       // of each face
    std::vector<uint32_t> by_row_;  // faces, by where they begin
    uint32_t band_rows_ = 1;
    ImageShape shape_;
};

}  // namespace raypager
