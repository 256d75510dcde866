// An OpenCL device as the engine uses it: buffers that are counted against a limit, in-order queues for kernels, for
// kernels beside those, and for uploads, kernels from the embedded sources. The only place where buffers are created, and the only user of OpenCL's
// headers.
#pragma once

#include <CL/opencl.hpp>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/memory.hpp"
#include "device/hooks.hpp"
#include "device/kernel_sources.hpp"
#include "raypager/devices.hpp"
#include "raypager/status.hpp"

namespace raypager {

std::string cl_error_name(cl_int code);  // "CL_OUT_OF_RESOURCES"
Status cl_failed(std::string_view what, cl_int code);

// Bytes of device memory in use, against a limit. Thread-safe.
class MemoryBudget {
public:
    explicit MemoryBudget(uint64_t limit) : limit_(limit) {}
    uint64_t limit() const { return limit_; }
    uint64_t used() const { return used_; }
    uint64_t peak() const { return peak_; }
    bool reserve(uint64_t bytes);  // false, and nothing reserved, if that would pass the limit
    void release(uint64_t bytes) { used_ -= bytes; }

private:
    const uint64_t limit_;
    std::atomic<uint64_t> used_{0}, peak_{0};
};

// A device buffer; counted from creation to destruction.
class Buffer {
public:
    Buffer() = default;
    Buffer(Buffer&&) noexcept = default;
    Buffer& operator=(Buffer&&) noexcept = default;
    uint64_t bytes() const { return bytes_; }
    const cl::Buffer& handle() const { return handle_; }

private:
    friend class Device;
    cl::Buffer handle_;
    uint64_t bytes_ = 0;
    std::shared_ptr<void> reservation_;
};

// Host memory that the device can copy from and to at full speed. REQUIRES: no such copy is under way when it is destroyed.
class PinnedBuffer {
public:
    std::span<std::byte> bytes() const { return bytes_; }

private:
    friend class Device;
    cl::Buffer handle_;
    std::span<std::byte> bytes_;
};

// A transfer or kernel under way. Default-constructed: done.
class Event {
public:
    Event() = default;
    // Whether it has ended; an error if it ended badly.
    Result<bool> finished() const;
    Status wait() const;
    // On the device's clock, in nanoseconds, after it has finished; both 0 if unknown.
    struct Interval {
        uint64_t begin = 0, end = 0;
    };
    Interval interval() const;
    uint64_t duration_ns() const { return interval().end - interval().begin; }
    const cl::Event& handle() const { return handle_; }
    bool empty() const { return handle_() == nullptr; }

private:
    friend class Queue;
    cl::Event handle_;
};

class Kernel {
public:
    Kernel() = default;
    // Sets all arguments in order: Buffers and plain values.
    template <class... Arguments>
    Status set(const Arguments&... arguments) {
        cl_uint index = 0;
        cl_int code = CL_SUCCESS;
        ((code = code == CL_SUCCESS ? set_one(index++, arguments) : code), ...);
        return code == CL_SUCCESS ? Status() : cl_failed(name_ + ": setting argument " + std::to_string(index - 1), code);
    }
    const std::string& name() const { return name_; }

private:
    friend class Device;
    friend class Queue;
    cl_int set_one(cl_uint index, const Buffer& buffer) { return kernel_.setArg(index, buffer.handle()); }
    template <class T>
    cl_int set_one(cl_uint index, const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        return kernel_.setArg(index, value);
    }
    std::string name_;
    mutable cl::Kernel kernel_;
};

// An in-order command queue.
class Queue {
public:
    Status launch(const Kernel& kernel, uint64_t items, uint32_t group_size, Event* event = nullptr);
    Status fill_zero(const Buffer& buffer, uint64_t offset, uint64_t bytes);
    // All of a buffer into another. REQUIRES: the target is as large.
    Status copy(const Buffer& source, const Buffer& target);
    // The source must stay as it is until the event has finished.
    // `after`, if given, is an event of another queue that comes first.
    Status write(const Buffer& buffer, uint64_t offset, std::span<const std::byte> source, Event* event, const Event* after = nullptr);
    Status read(const Buffer& buffer, uint64_t offset, std::span<std::byte> target, Event* event);
    Status write_now(const Buffer& buffer, uint64_t offset, std::span<const std::byte> source);
    Status read_now(const Buffer& buffer, uint64_t offset, std::span<std::byte> target);
    // What follows begins after this event of another queue.
    Status wait_for(const Event& event);
    Status flush();
    Status finish();

private:
    friend class Device;
    // Gives a command, unless the device is lost.
    template <class Enqueue>
    cl_int command(const Enqueue& enqueue) {
        return hooks_->may_command() ? enqueue() : CL_INVALID_COMMAND_QUEUE;
    }
    cl::CommandQueue queue_;
    DeviceHooks* hooks_ = nullptr;
};

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
    return std::as_bytes(std::span(values));
}

// stage: kernels/<stage>.cl. definitions: "-DNAME=VALUE ..." beside those of the device.
struct KernelName {
    std::string stage, name, definitions;
};

class Device {
public:
    // selector: an index of list_devices, part of a name, or empty for the default. memory_limit 0: default_limit(). tuning: of its profile. hooks:
    // null: none.
    static Result<std::unique_ptr<Device>> open(const std::string& selector, uint64_t memory_limit, const ProfileChanges& tuning = {},
                                                std::shared_ptr<DeviceHooks> hooks = nullptr);

    const DeviceInfo& info() const { return info_; }
    const DeviceProfile& profile() const { return info_.profile; }
    const MemoryBudget& budget() const { return *budget_; }
    DeviceHooks& hooks() const { return *hooks_; }
    const DefaultLimit& default_limit() const { return default_limit_; }  // three quarters of its memory; on a CPU half of main memory
    // Whether an allocation within the limit has failed because the device had no more memory to give.
    bool refused_memory() const { return refused_memory_; }
    Queue& kernels() { return kernels_; }
    Queue& uploads() { return uploads_; }
    // For kernels that run beside those of kernels().
    Queue& concurrent() { return concurrent_; }
    // Whether several threads may give commands at a time, as OpenCL promises. oclgrind crashes: its queues share lists without a lock.
    bool thread_safe() const { return info_.platform != "Oclgrind"; }
    uint32_t group_size() const { return group_size_; }
    // Whether kernels of persistent threads (kernels/single_ray/persistent.cl) are to trace extension rays, and the definitions that make them:
    // camera rays stay together and fetch new rays together; bounces, which end at different times, fetch sooner, keep the lower part of their stacks
    // in local memory, and let leaves go first where few are still at inner nodes. Both say how many rays in a row are of one multiprocessor's part
    // of the queue.
    bool has_persistent_threads() const { return persistent_threads_; }
    std::string camera_definitions() const;
    std::string bounce_definitions() const;
    // Compiler options for a kernel that is to have no more registers than so many (0: as the compiler likes), where it can be told: with fewer of
    // them more of its work-items run at a time.
    std::string register_limit(uint32_t registers) const;
    // Compiler options for a kernel whose divisions and square roots need not be rounded correctly but where it says so (rp_div, rp_sqrt). Empty
    // where that gains nothing. A GPU does them by an instruction or two instead of dozens.
    std::string quick_arithmetic() const;
    // Persistent threads that fill it.
    uint64_t persistent_items() const { return uint64_t{info_.compute_units} * profile().persistent_items; }

    // what: for messages. An error names the limit that would be needed. Never 0 bytes: OpenCL has no empty buffers. The buffer holds
    // zeros: drivers that allocate at first use only must do so now, where a refusal can still be answered with a smaller plan.
    Result<Buffer> allocate(uint64_t bytes, std::string_view what);
    Result<Buffer> upload(std::span<const std::byte> contents, std::string_view what);
    Result<PinnedBuffer> allocate_pinned(uint64_t bytes);
    // A buffer in host memory that kernels read in place, if the driver can (CL_MEM_ALLOC_HOST_PTR). Not counted: it is no device memory.
    Result<Buffer> allocate_mapped(uint64_t bytes, std::string_view what);

    // Kernel sources beside those of the build, which tests have. What they refer to outlives this.
    void use_more_sources(std::span<const KernelSource> sources) { more_sources_ = sources; }
    // Builds kernels/<stage>.cl (from the cache of binaries if it is there) and gets a kernel of it.
    Result<Kernel> kernel(const KernelName& name);
    // Builds what is not there yet of the programs of these kernels; several at a time, where that is quicker (raypager/kernel_builder.hpp). Fails
    // for none: whoever asks for the kernel is told. Those that take longest come first.
    void build_ahead(std::span<const KernelName> kernels);
    Status build(const KernelName& name) { return program(name).status(); }
    double build_seconds() const { return build_seconds_; }

private:
    Device() = default;
    // NVIDIA's Volta or a later one: before it, work-items of a sub-group that had gone different ways could not meet in a vote, and first chips had
    // no dp2a.
    bool since_volta() const;
    bool is_nvidia() const { return info_.platform.find("NVIDIA") != std::string::npos; }
    Status refused(uint64_t bytes, std::string_view what, cl_int code);
    Result<cl::Program> program(const KernelName& name);
    std::string build_options(const std::string& definitions) const;

    DeviceInfo info_;
    std::shared_ptr<DeviceHooks> hooks_;  // never null
    cl::Device device_;
    cl::Context context_;
    Queue kernels_, uploads_, concurrent_;
    uint32_t group_size_ = 64;
    std::shared_ptr<MemoryBudget> budget_;
    DefaultLimit default_limit_;
    bool refused_memory_ = false;
    bool persistent_threads_ = false;
    std::map<std::string, cl::Program> programs_;
    std::span<const KernelSource> more_sources_;
    double build_seconds_ = 0;
};

}  // namespace raypager
