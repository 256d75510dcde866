#include "cli/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

#include "base/log.hpp"
#include "cli/verbs.hpp"
#include "raypager/kernel_builder.hpp"

namespace raypager {
namespace {

constexpr auto verbs = std::to_array<Verb>({
    {"devices", "list the OpenCL devices", run_devices},
    {"make-scene", "write a procedural scene of any size", run_make_scene},
    {"bake", "cut a scene into blocks and write a block file", run_bake},
    {"inspect", "say what is in a block file; check it", run_inspect},
    {"render", "render a scene or a block file", run_render},
    {"plan", "say what a render would take, and with other limits", run_plan},
#ifdef RAYPAGER_VIEW
    {"view", "look at a scene in a browser while it renders", run_view},
#endif
    {"compare", "say how far two pictures are apart", run_compare},
    {"bench", "measure the program itself", run_bench},
});

std::string help_text() {
    std::string text = "raypager path-traces scenes many times larger than the device's memory.\n\nUsage: raypager VERB ...\n\n";
    for (const Verb& verb : verbs) text += fmt::format("  {:<12}{}\n", verb.name, verb.about);
    return text +
           "\n'raypager help VERB' shows the options of a verb with defaults and units. '--version' shows the version.\n\n"
           "Sizes take a unit: 512K, 1.5G, 8GB, 8GiB (all binary). Numbers of things do, too: 2.5M (decimal).\n\n"
           "Exit status:\n"
           "  0  done\n"
           "  1  the work failed; one line on stderr says what, where and what to do\n"
           "  2  bad usage\n"
           "  3  stopped by Ctrl-C (SIGINT) or SIGTERM; what there is was written\n";
}

std::string verb_names() {
    std::string names;
    for (const Verb& verb : verbs) names += (names.empty() ? "" : ", ") + std::string(verb.name);
    return names;
}

Result<const Verb*> find_verb(const std::string& name) {
    const auto* verb = std::find_if(verbs.begin(), verbs.end(), [&](const Verb& candidate) { return candidate.name == name; });
    if (verb == verbs.end()) return Status::usage(fmt::format("'{}' is not a verb; use one of {}, or help", name, verb_names()));
    return verb;
}

// of: a verb, and for bench a measurement, as in 'raypager help bench sweep'; or nothing.
Status show_help(const Arguments& of) {
    if (of.empty() || of.front().starts_with("-")) {
        std::fputs(help_text().c_str(), stdout);
        return {};
    }
    const auto verb = find_verb(of.front());
    if (!verb) return verb.status();
    Arguments rest(of.begin() + 1, of.end());
    rest.emplace_back("--help");
    return (*verb)->run(rest);
}

Status dispatch(const Arguments& arguments) {
    if (arguments.empty()) return Status::usage(fmt::format("no verb is given; use one of {}, or help", verb_names()));
    const std::string& first = arguments.front();
    if (first == "--help" || first == "-h" || first == "help") return show_help({arguments.begin() + 1, arguments.end()});
    if (first == "--version") {
        std::fputs("raypager " RAYPAGER_VERSION "\n", stdout);
        return {};
    }
    if (first == "generate") return run_generate({arguments.begin() + 1, arguments.end()});
    if (first == kernel_builder_verb) return build_kernels(std::span(arguments).subspan(1));
    const auto verb = find_verb(first);
    return verb ? (*verb)->run({arguments.begin() + 1, arguments.end()}) : verb.status();
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

std::span<const Verb> all_verbs() { return verbs; }

int run_program(const Arguments& arguments) noexcept {
#ifdef SIGXFSZ
    // A file that may not grow any further is an error like a full disk.
    (void)std::signal(SIGXFSZ, SIG_IGN);
#endif
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
