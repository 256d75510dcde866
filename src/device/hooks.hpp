// What a device is about to do, for whoever wants a say in it: tests, which let devices fail, wait, or be others than they are.
#pragma once

#include <cstdint>

namespace raypager {

// As it is: nothing is refused, nothing changed. Handed to Device::open. Any number of threads at once.
class DeviceHooks {
public:
    virtual ~DeviceHooks() = default;
    virtual bool has_platforms() { return true; }
    virtual bool has_devices() { return true; }
    // Whether vectors of one lane are taken for persistent threads, where those of the hardware are not known.
    virtual bool has_persistent_threads() { return false; }
    // Whether kernels build; binaries from the cache do not load either.
    virtual bool may_build() { return true; }
    // total_bytes: of all buffers of the device, with the one that is asked for.
    virtual bool may_allocate([[maybe_unused]] uint64_t total_bytes) { return true; }
    virtual bool may_pin() { return true; }
    // Before every command to a queue; false: the device is lost.
    virtual bool may_command() { return true; }
    // Before a block is uploaded, by the thread that brings it.
    virtual void before_upload() {}
    // When uploads have been given to the queue, by the same thread.
    virtual void after_upload() {}
};

}  // namespace raypager
