#include "raypager/image_source.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <system_error>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "image/formats.hpp"

namespace raypager {
namespace {

// Opened each time that somebody wants to know of it.
class OpenedImage : public ImageSource {
public:
    Result<ImageShape> shape() const override {
        const auto rows = open();
        if (!rows) return rows.status();
        return (*rows)->shape();
    }

    Status read(const std::function<Status(std::span<const std::byte>)>& take) const override {
        const auto rows = open();
        return rows ? (*rows)->read(take) : rows.status();
    }

private:
    virtual Result<std::unique_ptr<ImageRows>> open() const = 0;
};

class ImageFileSource final : public OpenedImage {
public:
    ImageFileSource(std::filesystem::path path, const ImageEncoding& encoding) : path_(std::move(path)), encoding_(encoding) {}
    std::string name() const override { return path_.string(); }

    // Not by what is in it: that would take as long as to read it.
    Result<uint64_t> fingerprint() const override {
        std::error_code error;
        const auto size = std::filesystem::file_size(path_, error);
        if (error) return Status::failed(fmt::format("{}: cannot be examined: {}", name(), error.message()));
        const auto time = std::filesystem::last_write_time(path_, error);
        if (error) return Status::failed(fmt::format("{}: cannot be examined: {}", name(), error.message()));
        const auto whole = std::filesystem::absolute(path_, error);
        return hash64(fmt::format("{} {} {} {} {}", error ? name() : whole.lexically_normal().string(), size, time.time_since_epoch().count(),
                                  static_cast<int>(encoding_.kind), encoding_.gamma));
    }

private:
    Result<std::unique_ptr<ImageRows>> open() const override {
        if (encoding_.kind == ImageEncoding::Kind::gamma && !(encoding_.gamma > 0 && std::isfinite(encoding_.gamma)))
            return Status::failed(fmt::format("{}: cannot be read with a gamma of {}; it must be more than 0", name(), encoding_.gamma));
        auto portable = open_portable_rows(path_, encoding_);
        if (!portable || *portable) return portable;
        if (const ImageLibrary* library = used_image_library()) return library->open_rows(path_, encoding_);
        return Status::failed(fmt::format("{}: is no binary PPM, PGM or PFM image; this build reads no others (it is without OpenImageIO)", name()));
    }

    const std::filesystem::path path_;
    const ImageEncoding encoding_;
};

class MemoryImage final : public ImageSource {
public:
    MemoryImage(std::string name, const ImageShape& shape, std::vector<std::byte> texels)
        : name_(std::move(name)), shape_(shape), texels_(std::move(texels)) {}
    std::string name() const override { return name_; }
    Result<ImageShape> shape() const override { return shape_; }
    Status read(const std::function<Status(std::span<const std::byte>)>& take) const override { return take(texels_); }
    Result<uint64_t> fingerprint() const override {
        return hash64(
            texels_, hash64(fmt::format("{} {} {} {} {}", shape_.width, shape_.height, shape_.channels, static_cast<int>(shape_.kind), shape_.srgb)));
    }

private:
    const std::string name_;
    const ImageShape shape_;
    const std::vector<std::byte> texels_;
};

class EmbeddedImage final : public OpenedImage {
public:
    EmbeddedImage(std::string name, std::string ending, std::shared_ptr<const std::byte[]> bytes, size_t size, const ImageEncoding& encoding)
        : name_(std::move(name)), ending_(std::move(ending)), bytes_(std::move(bytes)), size_(size), encoding_(encoding) {}
    std::string name() const override { return name_; }

    Result<uint64_t> fingerprint() const override {
        return hash64(std::span(bytes_.get(), size_), hash64(fmt::format("{} {}", static_cast<int>(encoding_.kind), encoding_.gamma)));
    }

private:
    Result<std::unique_ptr<ImageRows>> open() const override {
        if (const ImageLibrary* library = used_image_library())
            return library->open_embedded_rows({name_, ending_, std::span(bytes_.get(), size_)}, encoding_);
        return Status::failed(fmt::format("{}: images inside of other files are not read by this build (it is without OpenImageIO)", name_));
    }

    const std::string name_, ending_;
    const std::shared_ptr<const std::byte[]> bytes_;
    const size_t size_;
    const ImageEncoding encoding_;
};

}  // namespace

std::shared_ptr<const ImageSource> embedded_image(std::string name, std::string ending, std::shared_ptr<const std::byte[]> bytes, size_t size,
                                                  const ImageEncoding& encoding) {
    return std::make_shared<EmbeddedImage>(std::move(name), std::move(ending), std::move(bytes), size, encoding);
}

std::shared_ptr<const ImageSource> image_file_source(const std::filesystem::path& path, const ImageEncoding& encoding) {
    return std::make_shared<ImageFileSource>(path, encoding);
}

std::shared_ptr<const ImageSource> memory_image(std::string name, const ImageShape& shape, std::vector<std::byte> texels) {
    RAYPAGER_CHECK(texels.size() == uint64_t{shape.width} * shape.height * shape.channels * bytes_of_channel(shape.kind));
    return std::make_shared<MemoryImage>(std::move(name), shape, std::move(texels));
}

}  // namespace raypager
