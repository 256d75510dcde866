// Errors of the engine as raypager.Error, which has the message and the exit status that the command line would end with.
#pragma once

#include <nanobind/nanobind.h>

#include <utility>

#include "raypager/status.hpp"

namespace raypager::python {

// Raises it. REQUIRES: the GIL, and that status is not ok.
[[noreturn]] void raise(const Status& status);

inline void check(const Status& status) {
    if (!status) raise(status);
}

template <class T>
T value_of(Result<T> result) {
    if (!result) raise(result.status());
    return std::move(*result);
}

// What does not touch Python, while other threads of it go on.
template <class Work>
auto without_gil(const Work& work) {
    const nanobind::gil_scoped_release release;
    return work();
}

}  // namespace raypager::python
