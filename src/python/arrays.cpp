#include "python/arrays.hpp"

#include <utility>

namespace raypager::python {

Film film_of(Image image) {
    const size_t shape[] = {image.height, image.width, image.channels};
    auto* const values = new std::vector<float>(std::move(image.values));
    const nb::capsule owner(values, [](void* pointer) noexcept { delete static_cast<std::vector<float>*>(pointer); });
    return Film(values->data(), 3, shape, owner);
}

Image image_of(const Pixels& pixels) {
    Image image{static_cast<uint32_t>(pixels.shape(1)), static_cast<uint32_t>(pixels.shape(0)), static_cast<uint32_t>(pixels.shape(2)), {}};
    image.values.assign(pixels.data(), pixels.data() + pixels.size());
    return image;
}

}  // namespace raypager::python
