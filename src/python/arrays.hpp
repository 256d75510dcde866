// numpy arrays as the engine reads them, and its pictures as numpy arrays, both without a copy.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "raypager/picture.hpp"
#include "raypager/scene.hpp"

namespace raypager::python {

namespace nb = nanobind;

// Arrays in the layout of C, as the package's Python part hands them over (raypager/_arrays.py).
template <class T, size_t columns>
using Table = nb::ndarray<const T, nb::shape<-1, columns>, nb::c_contig, nb::device::cpu>;
template <class T>
using Column = nb::ndarray<const T, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Matrices = nb::ndarray<const double, nb::shape<-1, 3, 4>, nb::c_contig, nb::device::cpu>;
using Pixels = nb::ndarray<const float, nb::shape<-1, -1, -1>, nb::c_contig, nb::device::cpu>;
using Film = nb::ndarray<nb::numpy, float, nb::ndim<3>>;

// Keeps something of Python's until the last copy goes, on whatever thread that is.
template <class Kept>
std::shared_ptr<const Kept> keep(Kept kept) {
    return std::shared_ptr<const Kept>(new Kept(std::move(kept)), [](const Kept* pointer) {
        if (!Py_IsInitialized()) return;
        const nb::gil_scoped_acquire gil;
        delete pointer;
    });
}

// Rows of an array that belongs to Python, and what keeps them there.
template <class Row>
struct Rows {
    std::span<const Row> values;
    std::shared_ptr<const void> owner;
};

template <class Row, class Array>
Rows<Row> rows_of(const Array& array) {
    return {{reinterpret_cast<const Row*>(array.data()), array.shape(0)}, keep(array)};
}

template <class Row, class Array>
Rows<Row> rows_of(const std::optional<Array>& array) {
    return array ? rows_of<Row>(*array) : Rows<Row>{};
}

Film film_of(Image image);  // [height, width, channels], which owns the picture
Image image_of(const Pixels& pixels);

inline Float3 float3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace raypager::python
