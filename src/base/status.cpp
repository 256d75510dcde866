#include "raypager/status.hpp"

namespace raypager {

const std::string& Status::message() const {
    static const std::string none;
    return error_ ? error_->second : none;
}

Status Status::at(const std::string& place) const {
    if (ok()) return *this;
    return Status(error_->first, place + ": " + error_->second);
}

}  // namespace raypager
