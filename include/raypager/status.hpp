// What the world can do to us (bad files, full disks, missing devices) travels as a value that the caller must look at.
// Bugs are assertions (base/check.hpp). Exceptions of libraries are converted at the edge where the library is called.
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace raypager {

// Exit status of the program for an error. device: one of OpenCL's, and the program ends with 1 as for others, unless another device can go on.
enum class ErrorKind { failed = 1, usage = 2, interrupted = 3, device = 4 };

class [[nodiscard]] Status {
public:
    Status() = default;
    // message: one line that names what, where and what to do.
    static Status failed(std::string message) { return Status(ErrorKind::failed, std::move(message)); }
    static Status device(std::string message) { return Status(ErrorKind::device, std::move(message)); }
    static Status usage(std::string message) { return Status(ErrorKind::usage, std::move(message)); }
    // Nothing went wrong, but the work was stopped from outside before its end.
    static Status interrupted(std::string message) { return Status(ErrorKind::interrupted, std::move(message)); }

    bool ok() const { return !error_; }
    explicit operator bool() const { return ok(); }
    const std::string& message() const;  // empty if ok
    // REQUIRES: not ok.
    ErrorKind kind() const { return error_ ? error_->first : ErrorKind::failed; }
    int exit_code() const { return !error_ ? 0 : kind() == ErrorKind::device ? 1 : static_cast<int>(kind()); }
    // The same error with a place before it: "place: message".
    Status at(const std::string& place) const;

private:
    Status(ErrorKind kind, std::string message) : error_(std::in_place, kind, std::move(message)) {}
    std::optional<std::pair<ErrorKind, std::string>> error_;
};

// A value or the reason why there is none.
template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : value_(std::move(value)) {}
    Result(Status error) : status_(std::move(error)) {}
    bool ok() const { return value_.has_value(); }
    explicit operator bool() const { return ok(); }
    const Status& status() const { return status_; }
    // REQUIRES: ok().
    T& value() { return *value_; }
    const T& value() const { return *value_; }
    T* operator->() { return &*value_; }
    const T* operator->() const { return &*value_; }
    T& operator*() { return *value_; }
    const T& operator*() const { return *value_; }

private:
    std::optional<T> value_;
    Status status_;
};

}  // namespace raypager

// Returns from the current function with the error if expression is not ok.
#define RAYPAGER_TRY(expression)                                                 \
    do {                                                                         \
        if (auto try_status = (expression); !try_status.ok()) return try_status; \
    } while (false)
