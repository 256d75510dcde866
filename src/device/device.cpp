#include "device/device.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <set>

#include "base/check.hpp"
#include "base/huge_pages.hpp"
#include "base/parallel.hpp"
#include "base/words.hpp"
#include "device/kernel_builder.hpp"
#include "device/program_cache.hpp"
#include "device/select.hpp"

namespace raypager {

Status cl_failed(std::string_view what, cl_int code) {
    const char* advice = "";
    if (code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_HOST_MEMORY)
        advice = "; the device is short of memory: close what else uses it, or try a smaller --memory-limit";
    // What drivers say of a device that fell off the bus or was reset; some say the same when they run out of memory.
    if (code == CL_OUT_OF_RESOURCES || code == CL_INVALID_COMMAND_QUEUE || code == CL_DEVICE_NOT_AVAILABLE || code == CL_INVALID_CONTEXT ||
        code == CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST)
        advice = "; the device is lost or short of memory: look into the system's log, or try a smaller --memory-limit";
    return Status::device(fmt::format("OpenCL: {} failed: {}{}", what, cl_error_name(code), advice));
}

std::string cl_error_name(cl_int code) {
    static const std::map<cl_int, const char*> names = {
        {CL_DEVICE_NOT_FOUND, "CL_DEVICE_NOT_FOUND"},
        {CL_DEVICE_NOT_AVAILABLE, "CL_DEVICE_NOT_AVAILABLE"},
        {CL_COMPILER_NOT_AVAILABLE, "CL_COMPILER_NOT_AVAILABLE"},
        {CL_MEM_OBJECT_ALLOCATION_FAILURE, "CL_MEM_OBJECT_ALLOCATION_FAILURE"},
        {CL_OUT_OF_RESOURCES, "CL_OUT_OF_RESOURCES"},
        {CL_OUT_OF_HOST_MEMORY, "CL_OUT_OF_HOST_MEMORY"},
        {CL_BUILD_PROGRAM_FAILURE, "CL_BUILD_PROGRAM_FAILURE"},
        {CL_INVALID_VALUE, "CL_INVALID_VALUE"},
        {CL_INVALID_BUFFER_SIZE, "CL_INVALID_BUFFER_SIZE"},
        {CL_INVALID_MEM_OBJECT, "CL_INVALID_MEM_OBJECT"},
        {CL_INVALID_BINARY, "CL_INVALID_BINARY"},
        {CL_INVALID_KERNEL_NAME, "CL_INVALID_KERNEL_NAME"},
        {CL_INVALID_KERNEL_ARGS, "CL_INVALID_KERNEL_ARGS"},
        {CL_INVALID_ARG_SIZE, "CL_INVALID_ARG_SIZE"},
        {CL_INVALID_WORK_GROUP_SIZE, "CL_INVALID_WORK_GROUP_SIZE"},
        {CL_INVALID_COMMAND_QUEUE, "CL_INVALID_COMMAND_QUEUE"},
        {CL_INVALID_CONTEXT, "CL_INVALID_CONTEXT"},
        {CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST, "CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST"}};
    const auto found = names.find(code);
    return found == names.end() ? fmt::format("error {}", code) : found->second;
}

bool MemoryBudget::reserve(uint64_t bytes) {
    uint64_t used = used_.load();
    do {
        if (bytes > limit_ || used > limit_ - bytes) return false;
    } while (!used_.compare_exchange_weak(used, used + bytes));
    const uint64_t now = used + bytes;
    uint64_t peak = peak_.load();
    while (peak < now && !peak_.compare_exchange_weak(peak, now)) {}
    RAYPAGER_CHECK(now <= limit_);
    return true;
}

Result<bool> Event::finished() const {
    if (handle_() == nullptr) return true;
    cl_int state = CL_COMPLETE;
    const cl_int code = handle_.getInfo(CL_EVENT_COMMAND_EXECUTION_STATUS, &state);
    if (code != CL_SUCCESS) return cl_failed("asking for the state of a command", code);
    if (state < 0) return cl_failed("a command on the device", state);
    return state == CL_COMPLETE;
}

Status Event::wait() const {
    if (handle_() == nullptr) return {};
    const cl_int code = handle_.wait();
    return code == CL_SUCCESS ? Status() : cl_failed("waiting for the device", code);
}

Event::Interval Event::interval() const {
    cl_ulong begin = 0, end = 0;
    if (handle_() == nullptr || handle_.getProfilingInfo(CL_PROFILING_COMMAND_START, &begin) != CL_SUCCESS ||
        handle_.getProfilingInfo(CL_PROFILING_COMMAND_END, &end) != CL_SUCCESS || end < begin)
        return {};
    return {begin, end};
}

namespace {

// In pieces: NVIDIA's driver (580) never comes back from filling 2^31 words or more with a pattern of four bytes. last: of the last piece.
cl_int enqueue_zeros(const cl::CommandQueue& queue, const cl::Buffer& buffer, uint64_t offset, uint64_t bytes, cl::Event* last) {
    constexpr uint64_t most = uint64_t{1} << 30;
    static_assert(most / sizeof(cl_uint) < uint64_t{1} << 31);
    cl_int code = CL_SUCCESS;
    for (const uint64_t end = offset + bytes; offset < end && code == CL_SUCCESS;) {
        const uint64_t piece = std::min(most, end - offset);
        code = (offset | piece) % sizeof(cl_uint) == 0 ? queue.enqueueFillBuffer(buffer, cl_uint{0}, offset, piece, nullptr, last)
                                                       : queue.enqueueFillBuffer(buffer, cl_uchar{0}, offset, piece, nullptr, last);
        offset += piece;
    }
    return code;
}

}  // namespace

Status Queue::launch(const Kernel& kernel, uint64_t items, uint32_t group_size, Event* event) {
    const uint64_t global = (items + group_size - 1) / group_size * group_size;
    const cl_int code = command([&] {
        return queue_.enqueueNDRangeKernel(kernel.kernel_, cl::NullRange, cl::NDRange(global), cl::NDRange(group_size), nullptr,
                                           event ? &event->handle_ : nullptr);
    });
    return code == CL_SUCCESS ? Status() : cl_failed("launching " + kernel.name(), code);
}

Status Queue::wait_for(const Event& event) {
    if (event.empty()) return {};
    const std::vector<cl::Event> before = {event.handle()};
    const cl_int code = command([&] { return queue_.enqueueBarrierWithWaitList(&before, nullptr); });
    return code == CL_SUCCESS ? Status() : cl_failed("making a queue wait", code);
}

Status Queue::fill_zero(const Buffer& buffer, uint64_t offset, uint64_t bytes) {
    RAYPAGER_CHECK(offset + bytes <= buffer.bytes());
    const cl_int code = command([&] { return enqueue_zeros(queue_, buffer.handle(), offset, bytes, nullptr); });
    return code == CL_SUCCESS ? Status() : cl_failed("clearing a buffer", code);
}

Status Queue::copy(const Buffer& source, const Buffer& target) {
    RAYPAGER_CHECK(source.bytes() <= target.bytes());
    const cl_int code = command([&] { return queue_.enqueueCopyBuffer(source.handle(), target.handle(), 0, 0, source.bytes()); });
    return code == CL_SUCCESS ? Status() : cl_failed("copying a buffer", code);
}

Status Queue::write(const Buffer& buffer, uint64_t offset, std::span<const std::byte> source, Event* event, const Event* after) {
    RAYPAGER_CHECK(offset + source.size() <= buffer.bytes());
    if (source.empty()) return {};
    std::vector<cl::Event> before;
    if (after && !after->empty()) before.push_back(after->handle());
    const cl_int code = command([&] {
        return queue_.enqueueWriteBuffer(buffer.handle(), CL_FALSE, offset, source.size(), source.data(), before.empty() ? nullptr : &before,
                                         event ? &event->handle_ : nullptr);
    });
    return code == CL_SUCCESS ? Status() : cl_failed("writing to the device", code);
}

Status Queue::read(const Buffer& buffer, uint64_t offset, std::span<std::byte> target, Event* event) {
    RAYPAGER_CHECK(offset + target.size() <= buffer.bytes());
    if (target.empty()) return {};
    const cl_int code = command([&] {
        return queue_.enqueueReadBuffer(buffer.handle(), CL_FALSE, offset, target.size(), target.data(), nullptr, event ? &event->handle_ : nullptr);
    });
    return code == CL_SUCCESS ? Status() : cl_failed("reading from the device", code);
}

Status Queue::write_now(const Buffer& buffer, uint64_t offset, std::span<const std::byte> source) {
    Event event;
    RAYPAGER_TRY(write(buffer, offset, source, &event));
    return event.wait();
}

Status Queue::read_now(const Buffer& buffer, uint64_t offset, std::span<std::byte> target) {
    Event event;
    RAYPAGER_TRY(read(buffer, offset, target, &event));
    return event.wait();
}

Status Queue::flush() {
    const cl_int code = queue_.flush();
    return code == CL_SUCCESS ? Status() : cl_failed("flushing a queue", code);
}

Status Queue::finish() {
    const cl_int code = queue_.finish();
    return code == CL_SUCCESS ? Status() : cl_failed("finishing a queue", code);
}

Result<std::unique_ptr<Device>> Device::open(const std::string& selector, uint64_t memory_limit, const ProfileChanges& tuning,
                                             std::shared_ptr<DeviceHooks> hooks) {
    if (!hooks) hooks = std::make_shared<DeviceHooks>();
    auto chosen = select_device(selector, *hooks);
    if (!chosen) return chosen.status();
    std::unique_ptr<Device> device(new Device);
    device->hooks_ = std::move(hooks);
    device->info_ = chosen->info;
    apply(tuning, device->info_.profile);
    device->device_ = chosen->device;
    cl_int code = CL_SUCCESS;
    device->context_ = cl::Context(chosen->device, nullptr, nullptr, nullptr, &code);
    if (code != CL_SUCCESS) return cl_failed("opening " + device->info_.name, code);
    for (Queue* queue : {&device->kernels_, &device->uploads_, &device->concurrent_}) {
        // Times are asked of kernels alone, and cost a GPU some microseconds a command.
        const auto properties = queue != &device->uploads_ ? cl::QueueProperties::Profiling : cl::QueueProperties::None;
        queue->queue_ = cl::CommandQueue(device->context_, chosen->device, properties, &code);
        if (code != CL_SUCCESS) return cl_failed("creating a command queue", code);
        queue->hooks_ = device->hooks_.get();
    }
    const uint64_t most = device->info_.memory_bytes;
    if (memory_limit > most)
        return Status::usage(
            fmt::format("--memory-limit {}: {} has only {}", format_bytes(memory_limit), device->info_.name, format_exact_bytes(most)));
    // A CPU device has the memory that other programs have left, and may say that it has less than there is; a GPU's driver does not tell how much
    // is left.
    const uint64_t quarters = device->profile().limit_quarters;
    device->default_limit_ = device->profile().shares_host_memory ? raypager::default_limit(total_memory() / 4 * quarters, available_memory())
                                                                  : DefaultLimit{most / 4 * quarters, most / 4 * quarters};
    // A limit that the device's own size cuts, and not other programs, does not count as reduced.
    if (!device->default_limit_.reduced()) device->default_limit_.usual = std::min(device->default_limit_.usual, most);
    device->default_limit_.bytes = std::min(device->default_limit_.bytes, most);
    device->budget_ = std::make_shared<MemoryBudget>(memory_limit ? memory_limit : device->default_limit_.bytes);
    size_t group = 0;
    chosen->device.getInfo(CL_DEVICE_MAX_WORK_GROUP_SIZE, &group);
    device->group_size_ = static_cast<uint32_t>(std::min<size_t>(64, std::max<size_t>(1, group)));
    device->persistent_threads_ = (device->since_volta() && device->group_size_ % 32 == 0) || device->hooks_->has_persistent_threads();
    return device;
}

namespace {

constexpr size_t page = 4096, huge_page = size_t{2} << 20;

// Lets the system give all of this memory.
void touch(std::span<std::byte> memory) {
    parallel_for((memory.size() + huge_page - 1) / huge_page, 1, [&](size_t begin, size_t end) {
        for (size_t at = begin * huge_page; at < std::min(memory.size(), end * huge_page); at += page) memory[at] = std::byte{0};
    });
}

// A buffer in memory of ours, in large pages. The memory goes when the buffer does.
struct HostBuffer {
    cl::Buffer buffer;
    std::span<std::byte> memory;
};

HostBuffer in_huge_pages(const cl::Context& context, size_t bytes, bool touched, cl_int* code) {
    void* allocated = nullptr;
    if (posix_memalign(&allocated, bytes < huge_page ? page : huge_page, bytes) != 0) {
        *code = CL_OUT_OF_HOST_MEMORY;
        return {};
    }
    std::unique_ptr<void, decltype(&std::free)> memory(allocated, &std::free);
    const std::span<std::byte> whole(static_cast<std::byte*>(allocated), bytes);
    ask_for_huge_pages(whole);
    if (touched) touch(whole);
    cl::Buffer buffer(context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes, allocated, code);
    if (*code == CL_SUCCESS) *code = buffer.setDestructorCallback([](cl_mem, void* host) { std::free(host); }, allocated);
    if (*code != CL_SUCCESS) {
        buffer = {};  // before its memory
        return {};
    }
    (void)memory.release();  // the callback's now
    return {std::move(buffer), whole};
}

}  // namespace

Result<Buffer> Device::allocate(uint64_t bytes, std::string_view what) {
    RAYPAGER_CHECK(bytes > 0);
    if (bytes > info_.max_allocation_bytes)
        return Status::failed(fmt::format("{}: {} are more than {} allocates at once ({})", what, format_bytes(bytes), info_.name,
                                          format_bytes(info_.max_allocation_bytes)));
    if (!budget_->reserve(bytes))
        return Status::failed(fmt::format("{}: {} more do not fit into the memory limit of {}, of which {} are in use; at least {} are needed", what,
                                          format_bytes(bytes), format_bytes(budget_->limit()), format_bytes(budget_->used()),
                                          format_exact_bytes(budget_->used() + bytes)));
    Buffer buffer;
    buffer.bytes_ = bytes;
    buffer.reservation_ = std::shared_ptr<void>(nullptr, [budget = budget_, bytes](void*) { budget->release(bytes); });
    // Linux hands out memory that it does not have, and kills when it is used.
    const bool too_much = !hooks_->may_allocate(budget_->used()) || (profile().shares_host_memory && bytes > available_memory());
    cl_int code = too_much ? CL_MEM_OBJECT_ALLOCATION_FAILURE : CL_SUCCESS;
    const bool huge = profile().shares_host_memory && bytes >= huge_page;
    // Rays jump about in the geometry: in large pages looking up addresses costs a CPU little.
    if (code == CL_SUCCESS)
        buffer.handle_ = huge ? in_huge_pages(context_, bytes, false, &code).buffer : cl::Buffer(context_, CL_MEM_READ_WRITE, bytes, nullptr, &code);
    if (code != CL_SUCCESS) return refused(bytes, what, code);
    cl::Event filled;
    code = enqueue_zeros(kernels_.queue_, buffer.handle_, 0, bytes, &filled);
    if (code == CL_SUCCESS) code = filled.wait();
    if (code != CL_SUCCESS) return refused(bytes, what, code);
    return buffer;
}

Status Device::refused(uint64_t bytes, std::string_view what, cl_int code) {
    refused_memory_ = code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_RESOURCES || code == CL_OUT_OF_HOST_MEMORY ||
                      code == CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST;
    return cl_failed(fmt::format("allocating {} for {}", format_bytes(bytes), what), code);
}

Result<Buffer> Device::upload(std::span<const std::byte> contents, std::string_view what) {
    auto buffer = allocate(std::max<uint64_t>(contents.size(), 16), what);
    if (!buffer) return buffer.status();
    RAYPAGER_TRY(kernels_.write_now(*buffer, 0, contents));
    return buffer;
}

Result<PinnedBuffer> Device::allocate_pinned(uint64_t bytes) {
    // A driver pins 4 KiB of new memory in 2 us (H100), and launches nothing meanwhile; large pages that are there already, 20 times as fast.
    PinnedBuffer pinned;
    cl_int code = hooks_->may_pin() ? CL_SUCCESS : CL_OUT_OF_HOST_MEMORY;
    HostBuffer made;
    if (code == CL_SUCCESS) made = in_huge_pages(context_, bytes, !profile().shares_host_memory, &code);
    if (code != CL_SUCCESS) return cl_failed(fmt::format("allocating {} of pinned host memory", format_bytes(bytes)), code);
    pinned.handle_ = std::move(made.buffer);
    pinned.bytes_ = made.memory;
    return pinned;
}

Result<Buffer> Device::allocate_mapped(uint64_t bytes, std::string_view what) {
    Buffer buffer;
    buffer.bytes_ = bytes;
    cl_int code = CL_SUCCESS;
    buffer.handle_ = cl::Buffer(context_, CL_MEM_ALLOC_HOST_PTR | CL_MEM_READ_ONLY, bytes, nullptr, &code);
    if (code != CL_SUCCESS) return cl_failed(fmt::format("allocating {} of mapped host memory for {}", format_bytes(bytes), what), code);
    return buffer;
}

// To kernels, and to build_options (kernels/common/arithmetic.cl).
constexpr const char* quick_arithmetic_option = "-DRP_QUICK_ARITHMETIC";

std::string Device::build_options(const std::string& definitions) const {
    std::string options = "-cl-std=CL1.2 -w";  // PoCL tells people how many warnings there were, but not which
    cl_device_fp_config config = 0;
    device_.getInfo(CL_DEVICE_SINGLE_FP_CONFIG, &config);
    const bool quick = definitions.find(quick_arithmetic_option) != std::string::npos;
    if ((config & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) && !quick) options += " -cl-fp32-correctly-rounded-divide-sqrt";
    if (is_nvidia()) options += " -DRP_NV_PTX";
    // Whoever marks a block stores the same byte, so it makes no difference who does; a checker of races does not know that.
    if (info_.platform == "Oclgrind") options += " -DRP_ATOMIC_MARKS";
    if (info_.platform == "rusticl") options += " -DRP_TWO_WAYS_OUT";  // kernels/shading/light_tree.cl
    if (since_volta()) options += " -DRP_NV_DOT";
    return options + (definitions.empty() ? "" : " ") + definitions;
}

bool Device::since_volta() const {
    constexpr cl_device_info compute_capability_major = 0x4000;  // cl_nv_device_attribute_query
    cl_uint major = 0;
    return is_nvidia() && clGetDeviceInfo(device_(), compute_capability_major, sizeof major, &major, nullptr) == CL_SUCCESS && major >= 7;
}

std::string Device::camera_definitions() const {
    return fmt::format(" -DRP_PERSISTENT={} -DRP_PART_RUN={}", profile().camera_min_walks, profile().camera_part_run);
}

std::string Device::bounce_definitions() const {
    const DeviceProfile& p = profile();
    return fmt::format(" -DRP_PERSISTENT={} -DRP_MIN_INNER={} -DRP_SHARED_STACK={} -DRP_PART_RUN={} -DRP_GROUP_SIZE={}", p.bounce_min_walks,
                       p.bounce_min_inner, p.bounce_shared_stack, p.bounce_part_run, group_size_);
}

std::string Device::register_limit(uint32_t registers) const {
    return is_nvidia() && registers > 0 ? fmt::format("-cl-nv-maxrregcount={} ", registers) : "";
}

std::string Device::quick_arithmetic() const { return is_nvidia() ? fmt::format("{} ", quick_arithmetic_option) : ""; }

Result<cl::Program> Device::program(const KernelName& name) {
    const std::string options = build_options(name.definitions), key = name.stage + " " + options;
    if (const auto found = programs_.find(key); found != programs_.end()) return found->second;
    const auto begin = std::chrono::steady_clock::now();
    auto built = build_program(context_, device_, info_, name.stage + ".cl", options, more_sources_, *hooks_);
    if (!built) return built.status();
    build_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    programs_[key] = *built;
    return *built;
}

void Device::build_ahead(std::span<const KernelName> kernels) {
    if (profile().build_processes < 2 || !has_kernel_builder() || !more_sources_.empty()) return;
    std::set<std::string> seen;
    std::vector<KernelProgram> missing;
    for (const KernelName& kernel : kernels) {
        const std::string options = build_options(kernel.definitions);
        if (!seen.insert(kernel.stage + " " + options).second) continue;
        if (const auto bytes = missing_text(info_, kernel.stage + ".cl", options)) missing.push_back({kernel.stage, kernel.definitions, *bytes});
    }
    if (missing.size() < 2) return;
    const auto begin = std::chrono::steady_clock::now();
    KernelBuilders builders;
    const auto shares = share_programs(std::move(missing), profile().build_processes);
    for (size_t i = 1; i < shares.size(); i++)
        if (!shares[i].empty()) builders.start(std::to_string(info_.index), shares[i]);
    const double before = build_seconds_;
    for (const KernelProgram& mine : shares[0]) (void)program({mine.stage, {}, mine.definitions});
    builders.wait();
    build_seconds_ = before + std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Result<Kernel> Device::kernel(const KernelName& name) {
    auto built = program(name);
    if (!built) return built.status();
    Kernel kernel;
    kernel.name_ = name.name;
    cl_int code = CL_SUCCESS;
    kernel.kernel_ = cl::Kernel(*built, name.name.c_str(), &code);
    if (code != CL_SUCCESS) return cl_failed("getting kernel " + name.name, code);
    return kernel;
}

}  // namespace raypager
