// All shapes of a scene, wherever they stand.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// Its own, then those of its objects, each of them once: in the order in which their primitives are numbered. A status that take returns ends it.
template <class Take>
Status for_each_shape(const Scene& scene, const Take& take) {
    for (const Shape& shape : scene.shapes) RAYPAGER_TRY(take(shape));
    for (const Object& object : scene.objects)
        for (const Shape& shape : object.shapes) RAYPAGER_TRY(take(shape));
    return {};
}

}  // namespace raypager
