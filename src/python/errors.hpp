// Errors of the engine as raypager.Error, which has the message and the exit status that the command line would end with.
#pragma once

#include <nanobind/nanobind.h>

#include <string>
#include <utility>

#include "raypager/status.hpp"

namespace raypager::python {

// Raises it. REQUIRES: the GIL, and that status is not ok.
[[noreturn]] void raise(const Status& status);

// What Python raised, in one line. REQUIRES: the GIL.
std::string text_of(const nanobind::python_error& error);
// As an error of the engine: raypager.Error keeps its exit status, Ctrl-C is an interruption. REQUIRES: the GIL.
Status status_of(const nanobind::python_error& error);

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
