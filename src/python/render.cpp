// Renders, step by step.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/numbers.hpp"
#include "python/arrays.hpp"
#include "python/bindings.hpp"
#include "python/errors.hpp"
#include "raypager/denoise.hpp"
#include "raypager/report.hpp"
#include "raypager/session.hpp"

namespace raypager::python {
namespace {

// What the engine warns of on its threads, until Python asks.
class Warnings {
public:
    void add(const std::string& text) {
        const std::lock_guard lock(mutex_);
        texts_.push_back(text);
    }
    std::vector<std::string> take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(texts_, {});
    }

private:
    std::mutex mutex_;
    std::vector<std::string> texts_;
};

// A session that several threads of Python may call: one at a time goes on, the others wait without the GIL.
class SharedSession {
public:
    SharedSession(const Blocks& blocks, const RenderOptions& options) : blocks_(blocks), options_(options) {
        RenderCallbacks callbacks;
        callbacks.warning = [warnings = warnings_](const std::string& text) { warnings->add(text); };
        session_.emplace(value_of(without_gil([&] { return Session::create(blocks_, options_, callbacks); })));
    }
    ~SharedSession() {
        const nb::gil_scoped_release release;
        session_.reset();
    }
    SharedSession(const SharedSession&) = delete;
    SharedSession& operator=(const SharedSession&) = delete;

    bool done() {
        return value_of(alone([](Session& session) -> Result<bool> { return session.done(); }));
    }
    // In short pieces, between which signals to Python are answered.
    void step(double seconds) {
        using Clock = std::chrono::steady_clock;
        const auto begin = Clock::now();
        for (double passed = 0; passed == 0 || passed < seconds; passed = std::chrono::duration<double>(Clock::now() - begin).count()) {
            if (value_of(alone([&](Session& session) -> Result<bool> {
                    RAYPAGER_TRY(session.step(std::min(seconds - passed, 0.05)));
                    return session.done();
                })))
                return;
            if (PyErr_CheckSignals() != 0) throw nb::python_error();
        }
    }
    RenderProgress progress() {
        return value_of(alone([](Session& session) -> Result<RenderProgress> { return session.progress(); }));
    }
    Film snapshot() {
        return film_of(value_of(alone([](Session& session) { return session.snapshot(); })));
    }
    void checkpoint() {
        check(alone([](Session& session) { return session.checkpoint(); }));
    }
    void cancel() { session_->cancel(); }
    // The same, if there is a file for it.
    void keep() {
        if (!options_.checkpoint.file.empty()) checkpoint();
    }
    // Ends it with its last checkpoint; nobody wants the picture.
    void close() {
        if (options_.checkpoint.file.empty()) return;
        check(without_gil([&] {
            const std::lock_guard lock(mutex_);
            return std::exchange(ended_, true) ? Status() : session_->finish().status();
        }));
    }

    // Picture, report, and names and images of layers. Afterwards the device's memory is free again.
    nb::tuple finish(double total_seconds, double bake_seconds) {
        auto result = value_of(alone([&](Session& session) {
            auto finished = session.finish();
            ended_ = true;
            return finished;
        }));
        const std::string report = report_text(blocks_, options_, result.report, {total_seconds, bake_seconds});
        nb::list layers;
        for (FilmLayerImage& layer : result.layers)
            layers.append(nb::make_tuple(std::string(film_layer_name(layer.layer)), film_of(std::move(layer.image))));
        return nb::make_tuple(film_of(std::move(result.image)), report, layers);
    }
    std::vector<std::string> warnings() { return warnings_->take(); }

private:
    template <class Work>
    auto alone(const Work& work) -> decltype(work(std::declval<Session&>())) {
        const nb::gil_scoped_release release;
        const std::lock_guard lock(mutex_);
        if (ended_) return Status::usage("the render has ended, or failed; begin another");
        auto result = work(*session_);
        ended_ = ended_ || !result.ok();
        return result;
    }

    const Blocks blocks_;
    const RenderOptions options_;
    std::shared_ptr<Warnings> warnings_ = std::make_shared<Warnings>();
    std::mutex mutex_;
    bool ended_ = false;
    std::optional<Session> session_;
};

void add_render_options(nb::module_& module) {
    nb::class_<CheckpointOptions>(module, "CheckpointOptions")
        .def_rw("file", &CheckpointOptions::file)
        .def_rw("every_seconds", &CheckpointOptions::every_seconds)
        .def_rw("resume", &CheckpointOptions::resume);
    nb::class_<RenderTuning>(module, "RenderTuning")
        .def_rw("paths", &RenderTuning::paths)
        .def_rw("tile_size", &RenderTuning::tile_size)
        .def_rw("together", &RenderTuning::together)
        .def_prop_rw(
            "policy", [](const RenderTuning& tuning) { return std::string(policy_name(tuning.policy)); },
            [](RenderTuning& tuning, const std::string& name) {
                const auto kind = policy_from_name(name);
                if (!kind) raise(Status::usage("'" + name + "' is not a policy; use aged-wants, most-wanted, wanted-per-byte, lru or sweep"));
                tuning.policy = *kind;
            })
        .def_prop_rw(
            "traversal", [](const RenderTuning& tuning) { return std::string(traversal_names[static_cast<size_t>(tuning.traversal)].name); },
            [](RenderTuning& tuning, const std::string& name) {
                const auto traversal = traversal_from_name(name);
                if (!traversal) raise(Status::usage("'" + name + "' is not a kind of traversal; use auto, ray or stream"));
                tuning.traversal = *traversal;
            });
    nb::class_<RenderOptions>(module, "RenderOptions")
        .def(nb::init<>())
        .def_rw("device", &RenderOptions::device)
        .def_rw("allow_different", &RenderOptions::allow_different)
        .def_rw("memory_limit", &RenderOptions::memory_limit)
        .def_rw("geometry_limit", &RenderOptions::geometry_limit)
        .def_rw("geometry_limit_percent", &RenderOptions::geometry_limit_percent)
        .def_rw("host_limit", &RenderOptions::host_limit)
        .def_rw("spp", &RenderOptions::spp)
        .def_rw("width", &RenderOptions::width)
        .def_rw("height", &RenderOptions::height)
        .def_rw("max_depth", &RenderOptions::max_depth, nb::arg().none())
        .def_rw("time_seconds", &RenderOptions::time_seconds)
        .def_rw("seed", &RenderOptions::seed)
        .def_rw("adaptive_error", &RenderOptions::adaptive_error)
        .def("set_layers", [](RenderOptions& options, const std::string& list) { options.layers = value_of(parse_film_layers(list)); })
        .def_rw("camera", &RenderOptions::camera, nb::arg().none())
        .def_rw("checkpoint", &RenderOptions::checkpoint)
        .def_rw("tuning", &RenderOptions::tuning)
        .def_prop_rw(
            "roulette_connection", [](const RenderOptions& options) { return options.connection == Connection::roulette; },
            [](RenderOptions& options, bool roulette) { options.connection = roulette ? Connection::roulette : Connection::queue; })
        .def("set_background",
             [](RenderOptions& options, const std::array<float, 3>& color) {
                 options.background = {false, float3(color)};
             })
        .def("set_transparent", [](RenderOptions& options) {
            options.background = {true, {}};
        });
}

}  // namespace

void add_render(nb::module_& module) {
    add_render_options(module);
    nb::class_<RenderProgress>(module, "Progress", "How far a render is.")
        .def_ro("seconds", &RenderProgress::seconds, "Of rendering.")
        .def_ro("spp", &RenderProgress::spp, "Samples per pixel begun, on average.")
        .def_ro("fraction", &RenderProgress::fraction, "Of the whole, 0 to 1.")
        .def_ro("rays", &RenderProgress::rays)
        .def_ro("rays_per_second", &RenderProgress::rays_per_second, "Over the last interval.")
        .def_ro("loads", &RenderProgress::loads, "Of blocks and pages.")
        .def_ro("bytes_loaded", &RenderProgress::bytes_loaded)
        .def_ro("resident_bytes", &RenderProgress::resident_bytes, "Of blocks and pages on the device.")
        .def_ro("geometry_bytes", &RenderProgress::geometry_bytes, "Of all blocks and pages.")
        .def_prop_ro(
            "devices",
            [](const RenderProgress& progress) {
                nb::list devices;
                for (const RenderProgress::Device& device : progress.devices) {
                    nb::dict facts;
                    facts["rank"] = device.rank;
                    facts["index"] = device.index;
                    facts["samples"] = device.samples;
                    facts["rays"] = device.rays;
                    facts["bytes_loaded"] = device.bytes_loaded;
                    facts["resident_bytes"] = device.resident_bytes;
                    devices.append(facts);
                }
                return devices;
            },
            "Of each device: a dict of the rank of its process (0), its index, and of samples begun, rays, bytes loaded and resident.")
        .def("__repr__", [](const RenderProgress& progress) {
            return "Progress(fraction=" + std::to_string(progress.fraction) + ", spp=" + std::to_string(progress.spp) + ")";
        });
    nb::class_<SharedSession>(module, "Session")
        .def(nb::init<const Blocks&, const RenderOptions&>(), nb::arg("blocks"), nb::arg("options"))
        .def_prop_ro("done", &SharedSession::done)
        .def_prop_ro("progress", &SharedSession::progress)
        .def("step", &SharedSession::step, nb::arg("seconds"))
        .def("snapshot", &SharedSession::snapshot)
        .def("checkpoint", &SharedSession::checkpoint)
        .def("cancel", &SharedSession::cancel)
        .def("finish", &SharedSession::finish, nb::arg("total_seconds"), nb::arg("bake_seconds"))
        .def("keep", &SharedSession::keep)
        .def("close", &SharedSession::close)
        .def("warnings", &SharedSession::warnings);
    module.def(
        "write_image",
        [](const std::filesystem::path& path, const Pixels& film, double stops, const std::vector<std::pair<std::string, Pixels>>& layers) {
            check(without_gil([&]() -> Status {
                Image image = image_of(film);
                expose(image, stops);
                std::vector<FilmLayerImage> images;
                for (const auto& [name, values] : layers) {
                    auto layer = film_layer_named(name);
                    if (!layer) return layer.status();
                    images.push_back({*layer, image_of(values)});
                }
                return write_image_with_layers(path, image, images);
            }));
        },
        nb::arg("path"), nb::arg("film").noconvert(), nb::arg("exposure"), nb::arg("layers"));
    module.def("holds_layers", [](const std::filesystem::path& path) { return holds_layers(path); });
    module.def("find_denoiser", [](const std::filesystem::path& library) {
        const Denoiser found = value_of(without_gil([&] { return find_denoiser(library); }));
        return std::pair(found.library, found.version);
    });
    module.def(
        "denoise",
        [](const Pixels& film, const std::optional<Pixels>& albedo, const std::optional<Pixels>& normal, const std::filesystem::path& library,
           bool fast) {
            return film_of(value_of(without_gil([&] {
                const auto image = [](const std::optional<Pixels>& pixels) { return pixels ? std::optional(image_of(*pixels)) : std::nullopt; };
                const std::optional<Image> albedos = image(albedo), normals = image(normal);
                return denoise(image_of(film), albedos ? &*albedos : nullptr, normals ? &*normals : nullptr, {library, fast});
            })));
        },
        nb::arg("film").noconvert(), nb::arg("albedo").none(), nb::arg("normal").none(), nb::arg("library"), nb::arg("fast"));
    module.def("read_image", [](const std::filesystem::path& path) { return film_of(value_of(without_gil([&] { return read_image(path); }))); });
    module.def("parse_size", [](const std::string& text) { return value_of(parse_size(text)); });
    module.def("parse_size_or_percent", [](const std::string& text) {
        const SizeOrPercent limit = value_of(parse_size_or_percent(text));
        return std::pair(limit.bytes, limit.percent);
    });
}

}  // namespace raypager::python
