#include "cli/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

#include "base/log.hpp"
#include "cli/verbs.hpp"

namespace raypager {
namespace {

struct Verb {
    std::string_view name, about;
    Status (*run)(const Arguments& arguments);
};

constexpr std::array<Verb, 7> verbs = {{
    {"devices", "list the OpenCL devices", run_devices},
    {"make-scene", "write a procedural scene of any size", run_make_scene},
    {"bake", "cut a scene into blocks and write a block file", run_bake},
    {"inspect", "say what is in a block file; check it", run_inspect},
    {"render", "render a scene or a block file", run_render},
    {"compare", "say how far two pictures are apart", run_compare},
    {"bench", "measure the program itself", run_bench},
}};

std::string help_text() {
    std::string text = "raypager path-traces scenes many times larger than the device's memory.\n\nUsage: raypager VERB ...\n\n";
    for (const Verb& verb : verbs) text += fmt::format("  {:<12}{}\n", verb.name, verb.about);
    return text +
           "\n'raypager VERB --help' shows the options of a verb with defaults and units. '--version' shows the version.\n"
           "Sizes take K, M, G (binary). Exit status: 0 done, 1 the work failed, 2 bad usage,\n"
           "3 stopped by a signal, go on with --resume.\n";
}

std::string verb_names() {
    std::string names;
    for (const Verb& verb : verbs) names += (names.empty() ? "" : ", ") + std::string(verb.name);
    return names;
}

Status dispatch(const Arguments& arguments) {
    if (arguments.empty()) return Status::usage(fmt::format("no verb is given; use one of {}, or --help", verb_names()));
    const std::string& first = arguments.front();
    if (first == "--help" || first == "-h" || first == "help") {
        std::fputs(help_text().c_str(), stdout);
        return {};
    }
    if (first == "--version") {
        std::fputs("raypager " RAYPAGER_VERSION "\n", stdout);
        return {};
    }
    const auto* verb = std::find_if(verbs.begin(), verbs.end(), [&](const Verb& candidate) { return candidate.name == first; });
    if (verb == verbs.end()) return Status::usage(fmt::format("'{}' is no verb; use one of {}, or --help", first, verb_names()));
    return verb->run({arguments.begin() + 1, arguments.end()});
}

// What was printed may still fail to arrive, on a full disk for instance.
Status flush_output() {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return {};
    return Status::failed(fmt::format("standard output: cannot be written: {}", std::strerror(errno)));
}

Status run_guarded(const Arguments& arguments) {
    try {
        Status status = dispatch(arguments);
        return status ? flush_output() : status;
    } catch (const std::bad_alloc&) {
        return Status::failed("out of memory; close other programs, or give a smaller --host-limit or --memory-limit");
    } catch (const std::exception& error) {
        return Status::failed(fmt::format("unexpected error: {}; please report it with the command that you gave", error.what()));
    } catch (...) {
        return Status::failed("unexpected error of unknown kind; please report it with the command that you gave");
    }
}

// Messages of libraries and file names may contain line breaks; an error is one line all the same.
void print_error(std::string message) {
    std::replace_if(
        message.begin(), message.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    progress_line("");
    log_note(message);
}

}  // namespace

int run_program(const Arguments& arguments) noexcept {
    try {
        const Status status = run_guarded(arguments);
        if (!status) print_error(status.message());
        return status.exit_code();
    } catch (...) {  // not even the message found room
        std::fputs("raypager: out of memory\n", stderr);
        return 1;
    }
}

}  // namespace raypager
