// Block files and baking.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>

#include "python/bindings.hpp"
#include "python/errors.hpp"
#include "raypager/bake.hpp"
#include "raypager/import.hpp"

namespace nb = nanobind;

namespace raypager::python {
namespace {

// Where a bake is, told by its threads and asked for by Python's.
class Stage {
public:
    void set(const char* name, double fraction) {
        const std::lock_guard lock(mutex_);
        name_ = name;
        fraction_ = fraction;
        changed_ = true;
    }
    std::optional<std::pair<std::string, double>> take() {
        const std::lock_guard lock(mutex_);
        if (!changed_) return std::nullopt;
        changed_ = false;
        return std::pair(name_, fraction_);
    }

private:
    std::mutex mutex_;
    std::string name_;
    double fraction_ = 0;
    bool changed_ = false;
};

nb::dict summary_dict(const BakeSummary& summary) {
    nb::dict dict;
    dict["triangles"] = summary.triangles;
    dict["spheres"] = summary.spheres;
    dict["blocks"] = summary.blocks;
    dict["stored_bytes"] = summary.stored_bytes;
    dict["objects"] = summary.objects;
    dict["instances"] = summary.instances;
    dict["images"] = summary.images;
    dict["pages"] = summary.pages;
    dict["texture_bytes"] = summary.texture_bytes;
    dict["points_culled"] = summary.points_culled;
    dict["points_merged"] = summary.points_merged;
    dict["buckets"] = summary.buckets;
    dict["seconds"] = summary.seconds;
    return dict;
}

nb::list issues_list(const MeshIssues& issues) {
    nb::list list;
    for (const MeshWarning& warning : issues.warnings) list.append(warning.text);
    if (issues.any()) list.append(issues.describe());
    return list;
}

using Baked = std::pair<BakeSummary, std::optional<Blocks>>;

Result<Baked> bake_anywhere(const Scene& scene, const BakeOptions& options, const std::optional<std::filesystem::path>& path) {
    if (!path) {
        auto baked = bake(scene, options);
        if (!baked) return baked.status();
        return Baked{baked->summary, baked->blocks};
    }
    auto summary = bake(scene, options, *path);
    if (!summary) return summary.status();
    auto blocks = Blocks::open(*path);
    if (!blocks) return blocks.status();
    return Baked{*summary, *blocks};
}

// The bake has a thread of its own, so that this one, which Python gives signals to, can look for them and tell how far it is.
// on_stop is called when it is to end before its time: chunks that Python hands out must end, too.
nb::tuple bake_scene(const Scene& scene, BakeOptions options, const std::optional<std::filesystem::path>& path, const nb::object& progress,
                     const nb::callable& on_stop) {
    std::atomic<bool> stop{false};
    Stage stage;
    options.stop = &stop;
    if (!progress.is_none()) options.progress = [&stage](const char* name, double fraction) { stage.set(name, fraction); };
    auto work = std::async(std::launch::async, [&] { return bake_anywhere(scene, options, path); });
    const auto wait = [&] { return without_gil([&] { return work.wait_for(std::chrono::milliseconds(50)) == std::future_status::ready; }); };
    const auto tell = [&] {
        if (const auto at = stage.take()) progress(at->first, at->second);
    };
    try {
        while (!wait()) {
            if (PyErr_CheckSignals() != 0) throw nb::python_error();
            tell();
        }
        tell();
    } catch (...) {
        stop = true;
        {
            const nb::error_scope raised;
            on_stop();
        }
        without_gil([&] { work.wait(); });
        throw;
    }
    const auto result = value_of(without_gil([&] {
        auto baked = work.get();
        forget_unpacked_files();
        return baked;
    }));
    return nb::make_tuple(*result.second, summary_dict(result.first), issues_list(result.first.issues));
}

void add_bake_options(nb::module_& module) {
    nb::class_<PointOptions>(module, "PointOptions")
        .def(nb::init<>())
        .def_rw("radius", &PointOptions::radius)
        .def_rw("radius_from_spacing", &PointOptions::radius_from_spacing)
        .def_rw("radius_scale", &PointOptions::radius_scale)
        .def_rw("cull_to_camera", &PointOptions::cull_to_camera)
        .def_rw("cull_margin", &PointOptions::cull_margin)
        .def_rw("filter_to_image", &PointOptions::filter_to_image);
    nb::class_<BakeOptions>(module, "BakeOptions")
        .def(nb::init<>())
        .def_rw("block_bytes", &BakeOptions::block_bytes)
        .def_rw("block_entries", &BakeOptions::block_entries)
        .def_rw("position_error", &BakeOptions::position_error)
        .def_rw("host_limit", &BakeOptions::host_limit)
        .def_rw("points", &BakeOptions::points);
}

}  // namespace

void add_blocks(nb::module_& module) {
    add_bake_options(module);
    nb::class_<Blocks>(module, "Blocks")
        .def_prop_ro("width", &Blocks::width)
        .def_prop_ro("height", &Blocks::height)
        .def_prop_ro("spp", &Blocks::spp)
        .def_prop_ro("max_depth", &Blocks::max_depth)
        .def_prop_ro("camera", &Blocks::camera)
        .def_prop_ro("lower", &Blocks::lower)
        .def_prop_ro("upper", &Blocks::upper)
        .def_prop_ro("triangles", &Blocks::triangles)
        .def_prop_ro("spheres", &Blocks::spheres)
        .def_prop_ro("count", &Blocks::count)
        .def_prop_ro("images", &Blocks::images)
        .def_prop_ro("pages", &Blocks::pages)
        .def_prop_ro("stored_bytes", [](const Blocks& blocks) { return blocks.memory_bytes(BlockForm::stored); })
        .def_prop_ro("wide_bytes", [](const Blocks& blocks) { return blocks.memory_bytes(BlockForm::wide); });
    module.def("bake", &bake_scene, nb::arg("scene"), nb::arg("options"), nb::arg("path").none(), nb::arg("progress").none(), nb::arg("on_stop"),
               "Blocks, figures, and what was met and mended. progress(stage, fraction) is called now and then.");
    module.def("smallest_bake_limit", [] { return smallest_bake_limit(); });
    module.def(
        "open", [](const std::filesystem::path& path) { return value_of(without_gil([&] { return Blocks::open(path); })); }, nb::arg("path"));
}

}  // namespace raypager::python
