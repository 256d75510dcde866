// A variable of the environment, for as long as a test needs it.
#pragma once

#include <cstdlib>
#include <optional>
#include <string>

namespace raypager::support {

class ScopedVariable {
public:
    // value: null takes it away.
    ScopedVariable(const char* name, const char* value) : name_(name) {
        if (const char* old = std::getenv(name)) old_ = old;
        set(value);
    }
    ~ScopedVariable() { set(old_ ? old_->c_str() : nullptr); }
    ScopedVariable(const ScopedVariable&) = delete;
    ScopedVariable& operator=(const ScopedVariable&) = delete;

private:
    void set(const char* value) const { (void)(value ? ::setenv(name_, value, 1) : ::unsetenv(name_)); }
    const char* name_;
    std::optional<std::string> old_;
};

}  // namespace raypager::support
