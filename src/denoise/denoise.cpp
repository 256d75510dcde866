#include "raypager/denoise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "denoise/oidn_library.hpp"

namespace raypager {
namespace {

// Three floats a pixel, as the filter takes them.
struct Plane {
    const char* name = nullptr;  // of the filter's parameter
    std::vector<float> values;
};

using Device = std::unique_ptr<OidnDevice, void (*)(OidnDevice*)>;
using Filter = std::unique_ptr<OidnFilter, void (*)(OidnFilter*)>;

Status device_status(const OidnLibrary& oidn, OidnDevice* device) {
    const char* message = nullptr;
    const int error = oidn.get_device_error(device, &message);
    if (error == oidn_error_none && device) return {};
    const std::string text = message && *message ? message : fmt::format("error {}", error);
    return Status::failed(fmt::format("denoising failed: {} says: {}", oidn.path.string(), text));
}

// On the CPU, whatever else there is: memory of GPUs is the render's, by its limit.
Result<Device> open_device(const OidnLibrary& oidn) {
    Device device(oidn.new_device(oidn_device_cpu), oidn.release_device);
    RAYPAGER_TRY(device_status(oidn, device.get()));
    oidn.commit_device(device.get());
    RAYPAGER_TRY(device_status(oidn, device.get()));
    return device;
}

Plane plane_of(const char* name, const Image& image, float lowest, float highest) {
    const size_t pixels = size_t{image.width} * image.height;
    Plane plane{name, std::vector<float>(3 * pixels)};
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++) {
            const float value = image.values[i * image.channels + c];
            plane.values[3 * i + c] = std::isnan(value) ? 0.0f : std::clamp(value, lowest, highest);
        }
    return plane;
}

// The filter for ray-traced pictures, over planes of one size. hdr: linear light without an upper end; clean: planes that help have no noise.
Result<std::vector<float>> filtered(const OidnLibrary& oidn, OidnDevice* device, std::vector<Plane>& planes, const Image& size, bool hdr,
                                    bool clean) {
    const Filter filter(oidn.new_filter(device, "RT"), oidn.release_filter);
    RAYPAGER_TRY(device_status(oidn, device));
    if (!filter) return Status::failed(fmt::format("denoising failed: {} has no filter for ray-traced pictures", oidn.path.string()));
    for (Plane& plane : planes) oidn.set_image(filter.get(), plane.name, plane.values.data(), oidn_format_float3, size.width, size.height, 0, 0, 0);
    std::vector<float> output(planes.front().values.size());
    oidn.set_image(filter.get(), "output", output.data(), oidn_format_float3, size.width, size.height, 0, 0, 0);
    if (hdr) oidn.set_bool(filter.get(), "hdr", true);
    if (clean) oidn.set_bool(filter.get(), "cleanAux", true);
    oidn.commit_filter(filter.get());
    RAYPAGER_TRY(device_status(oidn, device));
    oidn.execute_filter(filter.get());
    RAYPAGER_TRY(device_status(oidn, device));
    return output;
}

Status check_guide(const char* name, const Image* guide, const Image& picture) {
    if (!guide) return {};
    if (guide->channels != 3) return Status::usage(fmt::format("denoise: {} has {} channels, not 3", name, guide->channels));
    if (guide->width != picture.width || guide->height != picture.height)
        return Status::usage(
            fmt::format("denoise: {} has {}x{} pixels, the picture {}x{}", name, guide->width, guide->height, picture.width, picture.height));
    return {};
}

Status check_values(const char* name, const Image* image) {
    if (!image || image->values.size() == size_t{image->width} * image->height * image->channels) return {};
    return Status::usage(fmt::format("denoise: {} has {} values, which is not width * height * channels", name, image->values.size()));
}

Status check_images(const Image& picture, const Image* albedo, const Image* normal) {
    if (picture.channels != 3 && picture.channels != 4)
        return Status::usage(fmt::format("denoise: the picture has {} channels, not 3 or 4", picture.channels));
    if (picture.width == 0 || picture.height == 0) return Status::usage("denoise: the picture is empty");
    if (normal && !albedo) return Status::usage("denoise: a normal helps beside an albedo alone; give both");
    RAYPAGER_TRY(check_guide("albedo", albedo, picture));
    RAYPAGER_TRY(check_guide("normal", normal, picture));
    RAYPAGER_TRY(check_values("the picture", &picture));
    RAYPAGER_TRY(check_values("albedo", albedo));
    return check_values("normal", normal);
}

// 20501 is 2.5.1.
std::string version_text(int version) { return fmt::format("{}.{}.{}", version / 10000, version / 100 % 100, version % 100); }

}  // namespace

Result<Denoiser> find_denoiser(const std::filesystem::path& library) {
    const auto oidn = open_oidn(library);
    if (!oidn) return oidn.status();
    const auto device = open_device(*oidn);
    if (!device) return device.status();
    return Denoiser{oidn->path, version_text(oidn->get_int(device->get(), "version"))};
}

Result<Image> denoise(const Image& picture, const Image* albedo, const Image* normal, const DenoiseOptions& options) {
    RAYPAGER_TRY(check_images(picture, albedo, normal));
    const auto oidn = open_oidn(options.library);
    if (!oidn) return oidn.status();
    const auto device = open_device(*oidn);
    if (!device) return device.status();
    std::vector<Plane> planes = {plane_of("color", picture, 0, std::numeric_limits<float>::max())};
    if (albedo) planes.push_back(plane_of("albedo", *albedo, 0, 1));
    if (normal) planes.push_back(plane_of("normal", *normal, -1, 1));
    // Albedo and normal are noisy, too, where things are small or out of focus: without noise they help more.
    const bool clean = !options.fast && planes.size() > 1;
    for (size_t i = 1; i < planes.size() && clean; i++) {
        std::vector<Plane> alone = {std::move(planes[i])};
        auto values = filtered(*oidn, device->get(), alone, picture, false, false);
        if (!values) return values.status();
        planes[i] = {alone.front().name, std::move(*values)};
    }
    const auto values = filtered(*oidn, device->get(), planes, picture, true, clean);
    if (!values) return values.status();
    if (!std::ranges::all_of(*values, [](float value) { return std::isfinite(value); }))
        return Status::failed(fmt::format("denoising failed: {} gave values that are not finite", oidn->path.string()));
    Image result = picture;
    for (size_t i = 0; i < size_t{picture.width} * picture.height; i++)
        std::copy_n(values->begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                    result.values.begin() + static_cast<std::ptrdiff_t>(i * picture.channels));
    return result;
}

}  // namespace raypager
