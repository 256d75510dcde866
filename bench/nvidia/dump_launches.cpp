// Writes down what launches of OpenCL kernels get, so that replay_launch.cpp can do them again, alone and under a profiler. NVIDIA's profilers do not
// see OpenCL; the program that its driver makes of a kernel is PTX, which CUDA takes as well.
//
//   DUMP_KERNELS=rp_extend,rp_connect DUMP_DIR=/tmp/launches LD_PRELOAD=./dump_launches.so raypager bench traverse ...
//
// For each of the first eight launches of these kernels: DIR/N_meta (name, global and local size, number of arguments; then a line an
// argument: index, bytes, "mem", "val" or "local"), and DIR/N_I, the bytes of argument I.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace {

constexpr int max_launches = 8;

struct Argument {
    size_t size = 0;
    std::string value;
    bool local = false;
};

std::mutex mutex;
std::map<cl_mem, size_t> buffers;
std::map<cl_kernel, std::map<cl_uint, Argument>> arguments;
int dumped = 0;

template <class F>
F next(const char* name) {
    return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

void dump(cl_command_queue queue, cl_kernel kernel, const char* name, size_t global, size_t local, const std::string& base) {
    FILE* meta = fopen((base + "meta").c_str(), "w");
    if (!meta) return perror(base.c_str());
    fprintf(meta, "%s %zu %zu %zu\n", name, global, local, arguments[kernel].size());
    for (const auto& [index, argument] : arguments[kernel]) {
        cl_mem buffer = nullptr;
        if (argument.size == sizeof buffer && !argument.local) memcpy(&buffer, argument.value.data(), sizeof buffer);
        const auto found = buffers.find(buffer);
        std::string bytes = argument.value;
        if (found != buffers.end()) {
            bytes.resize(found->second);
            clEnqueueReadBuffer(queue, buffer, CL_TRUE, 0, bytes.size(), bytes.data(), 0, nullptr, nullptr);
        }
        fprintf(meta, "%u %zu %s\n", index, found != buffers.end() ? found->second : argument.size,
                found != buffers.end() ? "mem"
                : argument.local       ? "local"
                                       : "val");
        if (FILE* file = fopen((base + std::to_string(index)).c_str(), "wb")) {
            fwrite(bytes.data(), 1, bytes.size(), file);
            fclose(file);
        }
    }
    fclose(meta);
}

}  // namespace

extern "C" cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
    static const auto real = next<decltype(&clCreateBuffer)>("clCreateBuffer");
    const cl_mem buffer = real(context, flags, size, host, error);
    const std::lock_guard lock(mutex);
    if (buffer) buffers[buffer] = size;
    return buffer;
}

extern "C" cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, size_t size, const void* value) {
    static const auto real = next<decltype(&clSetKernelArg)>("clSetKernelArg");
    {
        const std::lock_guard lock(mutex);
        Argument& argument = arguments[kernel][index];
        argument.size = size;
        argument.local = value == nullptr;
        if (value) argument.value.assign(static_cast<const char*>(value), size);
    }
    return real(kernel, index, size, value);
}

extern "C" cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t* offset, const size_t* global,
                                         const size_t* local, cl_uint waits, const cl_event* wait, cl_event* event) {
    static const auto real = next<decltype(&clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel");
    char name[64] = {};
    clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof name, name, nullptr);
    const char *wanted = getenv("DUMP_KERNELS"), *folder = getenv("DUMP_DIR");
    if (wanted && folder && strstr(wanted, name) && dumped < max_launches) {
        clFinish(queue);
        const std::lock_guard lock(mutex);
        dump(queue, kernel, name, global[0], local ? local[0] : 64, std::string(folder) + "/" + std::to_string(dumped++) + "_");
    }
    return real(queue, kernel, dimensions, offset, global, local, waits, wait, event);
}
