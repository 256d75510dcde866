// Does a launch that dump_launches.cpp has written down again, as CUDA: replay_launch DIR/N_ KERNEL.ptx REGISTERS REPEATS
// Prints registers, private and local bytes, and milliseconds. Every repeat finds the buffers as they were.
//
// The PTX is that of the kernel cache (~/.cache/raypager/kernels/*.bin, behind 16 characters), of the file in which the kernel's name follows
// ".entry". OpenCL's constant address space, which CUDA has nothing like, is replaced by global memory.
#include <cuda.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace {

void check(CUresult result, const char* what) {
    if (result == CUDA_SUCCESS) return;
    const char* text = "";
    cuGetErrorString(result, &text);
    fprintf(stderr, "%s: %s\n", what, text);
    exit(1);
}
#define CHECK(call) check(call, #call)

std::string read(const std::string& name) {
    std::ifstream file(name, std::ios::binary);
    if (!file) {
        fprintf(stderr, "%s cannot be read\n", name.c_str());
        exit(1);
    }
    return {std::istreambuf_iterator<char>(file), {}};
}

void replace(std::string& text, const std::string& from, const std::string& to) {
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) text.replace(at, from.size(), to);
}

struct Argument {
    std::string bytes;
    CUdeviceptr memory = 0, original = 0;
};

}  // namespace

int main(int count, char** values) {
    if (count != 5) return fprintf(stderr, "usage: replay_launch DIR/N_ KERNEL.ptx REGISTERS REPEATS\n"), 2;
    const std::string base = values[1];
    CHECK(cuInit(0));
    CUdevice device;
    CUcontext context;
    CHECK(cuDeviceGet(&device, 0));
    CHECK(cuDevicePrimaryCtxRetain(&context, device));
    CHECK(cuCtxSetCurrent(context));

    FILE* meta = fopen((base + "meta").c_str(), "r");
    char name[64];
    size_t global, local, number;
    if (!meta || fscanf(meta, "%63s %zu %zu %zu", name, &global, &local, &number) != 4)
        return fprintf(stderr, "%smeta is no launch\n", base.c_str()), 1;

    std::string ptx = read(values[2]);
    ptx = ptx.substr(std::min(ptx.find(".version"), ptx.size())).c_str();
    replace(ptx, "%envreg3", "0");                             // the global offset
    replace(ptx, "%envreg6", std::to_string(global / local));  // work-groups
    if (ptx.find("%envreg") != std::string::npos) return fprintf(stderr, "%s: asks for what CUDA does not set (%%envreg)\n", values[2]), 1;
    replace(ptx, "ld.const", "ld.global.nc");
    replace(ptx, "ptr .const", "ptr .global");
    char log[8192] = {};
    CUjit_option options[] = {CU_JIT_MAX_REGISTERS, CU_JIT_ERROR_LOG_BUFFER, CU_JIT_ERROR_LOG_BUFFER_SIZE_BYTES};
    void* option_values[] = {reinterpret_cast<void*>(strtoul(values[3], nullptr, 10)), log, reinterpret_cast<void*>(sizeof log)};
    CUmodule module;
    if (cuModuleLoadDataEx(&module, ptx.c_str(), 3, options, option_values) != CUDA_SUCCESS) return fprintf(stderr, "%s\n", log), 1;
    CUfunction kernel;
    CHECK(cuModuleGetFunction(&kernel, module, name));
    std::vector<Argument> arguments(number);
    std::vector<void*> pointers(number);
    for (size_t i = 0; i < number; i++) {
        unsigned index;
        size_t bytes;
        char kind[16];
        if (fscanf(meta, "%u %zu %15s", &index, &bytes, kind) != 3 || index >= number) return fprintf(stderr, "%smeta is damaged\n", base.c_str()), 1;
        Argument& argument = arguments[index];
        argument.bytes = read(base + std::to_string(index));
        pointers[index] = argument.bytes.data();
        if (strcmp(kind, "mem") != 0) continue;
        CHECK(cuMemAlloc(&argument.memory, bytes));
        CHECK(cuMemAlloc(&argument.original, bytes));
        CHECK(cuMemcpyHtoD(argument.original, argument.bytes.data(), bytes));
        pointers[index] = &argument.memory;
    }

    CUevent begin, end;
    CHECK(cuEventCreate(&begin, 0));
    CHECK(cuEventCreate(&end, 0));
    std::vector<float> milliseconds;
    for (int repeat = 0; repeat < atoi(values[4]); repeat++) {
        for (const Argument& argument : arguments)
            if (argument.memory) CHECK(cuMemcpyDtoD(argument.memory, argument.original, argument.bytes.size()));
        CHECK(cuEventRecord(begin, nullptr));
        CHECK(cuLaunchKernel(kernel, global / local, 1, 1, local, 1, 1, 0, nullptr, pointers.data(), nullptr));
        CHECK(cuEventRecord(end, nullptr));
        CHECK(cuCtxSynchronize());
        CHECK(cuEventElapsedTime(&milliseconds.emplace_back(), begin, end));
    }
    int registers, of_its_own, shared;
    CHECK(cuFuncGetAttribute(&registers, CU_FUNC_ATTRIBUTE_NUM_REGS, kernel));
    CHECK(cuFuncGetAttribute(&of_its_own, CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES, kernel));
    CHECK(cuFuncGetAttribute(&shared, CU_FUNC_ATTRIBUTE_SHARED_SIZE_BYTES, kernel));
    std::sort(milliseconds.begin(), milliseconds.end());
    printf("%s: %d registers, %d private bytes, %d local bytes, median %.4f ms, best %.4f ms\n", name, registers, of_its_own, shared,
           milliseconds.empty() ? 0.0f : milliseconds[milliseconds.size() / 2], milliseconds.empty() ? 0.0f : milliseconds[0]);
}
