#include "import/pbrt_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/files.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

// Bounds against hostile files, far beyond honest ones.
constexpr size_t deepest_include = 256, deepest_state = 4096;
constexpr uint64_t max_includes = 1000000;
// Of included files whose text is kept for the next time.
constexpr uint64_t largest_kept_text = uint64_t{1} << 16, max_kept_text = uint64_t{1} << 26;

struct Unsupported {
    std::string_view directive, instead;
    int version = 0;  // of pbrt, where only one has it
};
constexpr Unsupported unsupported[] = {
    {"Accelerator", "raypager builds its own hierarchy"},
    {"ColorSpace", "colours are taken as sRGB", 4},
    {"Option", "it is ignored", 4},
    {"Attribute", "the defaults that it sets are ignored", 4},
    {"MakeNamedMedium", "there are no participating media"},
    {"MediumInterface", "there are no participating media"},
    {"CameraMedium", "there are no participating media"},
    {"TransformTimes", "the scene does not move"},
    {"SurfaceIntegrator", "path tracing is used", 3},
    {"VolumeIntegrator", "path tracing is used"},
    {"Renderer", "path tracing is used"},
    {"Volume", "there are no participating media"},
};

}  // namespace

const std::unordered_map<std::string_view, PbrtReader::Handler>& PbrtReader::handlers() {
    static const std::unordered_map<std::string_view, Handler> table = {
        {"ActiveTransform", &PbrtReader::active_transform},
        {"AreaLightSource", &PbrtReader::area_light_source},
        {"AttributeBegin", &PbrtReader::attribute_begin},
        {"AttributeEnd", &PbrtReader::attribute_end},
        {"Camera", &PbrtReader::camera},
        {"ConcatTransform", &PbrtReader::concat_transform},
        {"CoordSysTransform", &PbrtReader::coord_sys_transform},
        {"CoordinateSystem", &PbrtReader::coordinate_system},
        {"Film", &PbrtReader::film},
        {"Identity", &PbrtReader::identity},
        {"Import", &PbrtReader::import},
        {"Include", &PbrtReader::include},
        {"Integrator", &PbrtReader::integrator},
        {"LightSource", &PbrtReader::light_source},
        {"LookAt", &PbrtReader::look_at},
        {"MakeNamedMaterial", &PbrtReader::make_named_material},
        {"Material", &PbrtReader::material},
        {"NamedMaterial", &PbrtReader::named_material},
        {"ObjectBegin", &PbrtReader::object_begin},
        {"ObjectEnd", &PbrtReader::object_end},
        {"ObjectInstance", &PbrtReader::object_instance},
        {"PixelFilter", &PbrtReader::pixel_filter},
        {"ReverseOrientation", &PbrtReader::reverse_orientation},
        {"Rotate", &PbrtReader::rotate},
        {"Sampler", &PbrtReader::sampler},
        {"Scale", &PbrtReader::scale},
        {"Shape", &PbrtReader::shape},
        {"Texture", &PbrtReader::texture},
        {"Transform", &PbrtReader::transform},
        {"TransformBegin", &PbrtReader::transform_begin},
        {"TransformEnd", &PbrtReader::transform_end},
        {"Translate", &PbrtReader::translate},
        {"WorldBegin", &PbrtReader::world_begin},
        {"WorldEnd", &PbrtReader::world_end},
    };
    return table;
}

Result<Scene> PbrtReader::read(const std::filesystem::path& path) {
    scene_.materials.push_back(diffuse_material({0.5f, 0.5f, 0.5f}));  // pbrt's default
    RAYPAGER_TRY(read_to_the_end(path));
    if (const Status placed = place_camera(); !placed.ok()) return placed.at(path.string());
    RAYPAGER_TRY(set_film_response());
    RAYPAGER_TRY(set_pixel_filter());
    RAYPAGER_TRY(finish_sky());
    if (const Status placed = place_objects(path.string()); !placed.ok()) return placed.at(path.string());
    map_textures_around_spheres(scene_);
    // Version 3 lets attributes and objects end in any order.
    if (odd_nesting_ && version_ != 3) warn(odd_nesting_location_, *odd_nesting_);
    if (scene_.shapes.empty() && scene_.instances.empty()) {
        if (!first_left_out_.empty()) return Status::failed(first_left_out_ + ", and nothing else is to be seen");
        return Status::failed(path.string() + ": has no shape, so there is nothing to be seen");
    }
    scene_.warnings = warnings_.lines();
    // An area light of which every shape was left out shines on nothing.
    if (scene_.lights.empty() && std::ranges::none_of(scene_.shapes, [](const Shape& shape) { return shape.area_light.has_value(); }))
        scene_.warnings.push_back(path.string() + ": there is no light; the picture will be black");
    if (const Status valid = validate(scene_); !valid.ok()) return valid.at(path.string());
    return std::move(scene_);
}

Status PbrtReader::read_to_the_end(const std::filesystem::path& path) {
    auto text = read_text(path);
    if (!text) return text.status();
    std::error_code ignored;
    RAYPAGER_TRY(read_file(path, std::filesystem::canonical(path, ignored), std::move(*text)));
    if (!any_known_) return Status::failed(path.string() + ": holds no directive of pbrt; is it a pbrt scene?");
    for (; !saved_.empty(); saved_.pop_back()) {
        const std::string what = fmt::format("{}Begin without {}End", scope_name(saved_.back().scope), scope_name(saved_.back().scope));
        if (!world_ended_ || object_)
            return Status::failed(fmt::format("{}: {}; the file is truncated or damaged", saved_.back().location.with_line(), what));
        warn(saved_.back().location, what);
    }
    if (object_)
        return Status::failed(fmt::format("{}: ObjectBegin without ObjectEnd; the file is truncated or damaged", object_location_.with_line()));
    if (!world_begun_) return Status::failed(path.string() + ": has no WorldBegin; is it a part that another file is to include?");
    return {};
}

Status PbrtReader::read_file(const std::filesystem::path& path, const std::filesystem::path& canonical, std::string text) {
    if (listed_files_.insert(path.string()).second) scene_.files.push_back(path.string());
    open_files_.push_back({path, canonical});
    PbrtTokens tokens(path, std::move(text));
    PbrtTokens* const outer = std::exchange(tokens_, &tokens);
    const Status status = read_directives();
    tokens_ = outer;
    open_files_.pop_back();
    return status;
}

Status PbrtReader::read_directives() {
    while (true) {
        const PbrtToken* token = nullptr;
        RAYPAGER_TRY(tokens_->peek(token));
        if (token->kind == PbrtTokenKind::end) return {};
        if (token->kind != PbrtTokenKind::word) return tokens_->error(*token, fmt::format("expected a directive instead of {}", token->describe()));
        const Directive directive{token->text, tokens_->location(*token)};
        tokens_->take();
        const auto handler = handlers().find(directive.name);
        any_known_ = any_known_ || handler != handlers().end();
        RAYPAGER_TRY(handler == handlers().end() ? skip_unsupported(directive) : (this->*handler->second)(directive));
    }
}

Status PbrtReader::skip_unsupported(const Directive& directive) {
    std::string_view instead = "it and its parameters are skipped";
    for (const Unsupported& u : unsupported)
        if (u.directive == directive.name) {
            instead = u.instead;
            if (u.version != 0) seems_version(u.version);
        }
    warn(directive.location, fmt::format("{} is not supported; {}", clipped(directive.name), instead));
    while (true) {
        const PbrtToken* token = nullptr;
        RAYPAGER_TRY(tokens_->peek(token));
        const bool value = token->kind == PbrtTokenKind::word && (token->text == "true" || token->text == "false");
        if (token->kind == PbrtTokenKind::end || (token->kind == PbrtTokenKind::word && !value)) return {};
        tokens_->take();
    }
}

Status PbrtReader::take_string(std::string& text) {
    const PbrtToken* token = nullptr;
    RAYPAGER_TRY(tokens_->peek(token));
    if (token->kind != PbrtTokenKind::string)
        return tokens_->error(*token, fmt::format("expected a string in quotes instead of {}", token->describe()));
    text = token->text;
    tokens_->take();
    return {};
}

Status PbrtReader::take_numbers(size_t count, double* numbers) {
    if (tokens_->take_numbers({numbers, count})) return {};
    for (size_t i = 0; i < count; ++i) {
        const PbrtToken* token = nullptr;
        RAYPAGER_TRY(tokens_->peek(token));
        if (token->kind != PbrtTokenKind::number)
            return tokens_->error(*token, fmt::format("expected number {} of {} instead of {}", i + 1, count, token->describe()));
        numbers[i] = token->number;
        tokens_->take();
    }
    return {};
}

Status PbrtReader::take_type_and_parameters(std::string& type, PbrtParameters& parameters) {
    RAYPAGER_TRY(take_string(type));
    return parameters.parse(*tokens_);
}

Status PbrtReader::error(const Directive& directive, const std::string& what) const {
    return Status::failed(fmt::format("{}: {}: {}", directive.location.with_column(), directive.name, what));
}

void PbrtReader::warn_if_present(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const char* instead) {
    for (const std::string_view name : names)
        if (const PbrtParameter* p = parameters.find(name)) warn(p->location, fmt::format("parameter \"{}\" is not supported; {}", name, instead));
}

void PbrtReader::warn_of_unused(const Directive& directive, const std::string& type, const PbrtParameters& parameters,
                                std::initializer_list<std::string_view> harmless) {
    if (const PbrtParameter* p = parameters.find_unused(harmless))
        warn(p->location, fmt::format("parameter \"{}\" of {} \"{}\" is not known; it is ignored", clipped(p->name), directive.name, clipped(type)));
}

void PbrtReader::leave_out(const Directive& directive, const std::string& what) {
    if (first_left_out_.empty()) first_left_out_ = fmt::format("{}: {}", directive.location.with_line(), what);
    warn(directive.location, what);
}

// Before WorldBegin there are only options; pbrt ignores, with an error, what is to be seen there.
bool PbrtReader::is_in_world(const Directive& directive, const std::string& type) {
    if (world_begun_) return true;
    warn(directive.location, fmt::format("{} \"{}\" before WorldBegin is left out", directive.name, clipped(type)));
    return false;
}

// Relative names count from the scene file, as in pbrt, or else from the file that is being read, or else from the working directory. What is
// there unpacked will do for a file that is packed. path: of the file, or of where it was looked for first.
Status PbrtReader::find_file(const std::string& name, std::filesystem::path& path, bool& exists) const {
    if (name.empty() || name.find('\0') != std::string::npos) return Status::failed("the name of a file is missing");
    const std::filesystem::path wanted(name);
    const std::filesystem::path folders[] = {open_files_.front().path.parent_path(), open_files_.back().path.parent_path(), {}};
    std::vector<std::filesystem::path> names = {wanted};
    if (wanted.extension() == ".gz") names.push_back(std::filesystem::path(wanted).replace_extension());
    path = folders[0] / wanted;  // absolute names stay as they are
    for (const auto& candidate : names)
        for (const auto& folder : folders) {
            std::error_code ignored;
            if (exists = std::filesystem::exists(folder / candidate, ignored); !exists) continue;
            path = folder / candidate;
            return {};
        }
    return {};
}

Status PbrtReader::find_include(const Directive& directive, const std::string& name, IncludedFile*& file) {
    const std::string key = open_files_.back().path.parent_path().string() + '\n' + name;
    const auto [at, added] = included_files_.try_emplace(key);
    file = &at->second;
    if (!added) return {};
    bool exists = false;
    if (const Status found = find_file(name, file->path, exists); !found.ok()) return error(directive, found.message());
    std::error_code ignored;
    file->canonical = std::filesystem::canonical(file->path, ignored);
    return {};
}

Status PbrtReader::include(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    if (open_files_.size() >= deepest_include) return error(directive, fmt::format("files include each other more than {} deep", deepest_include));
    if (++included_ > max_includes) return error(directive, fmt::format("more than {} files are included", max_includes));
    IncludedFile* file = nullptr;
    RAYPAGER_TRY(find_include(directive, name, file));
    for (const OpenFile& open : open_files_)
        if (!file->canonical.empty() && open.canonical == file->canonical)
            return error(directive, fmt::format("{} includes itself", file->path.string()));
    // A file that cannot be opened is an error of this line; errors inside it name their own place.
    if (file->text) return read_file(file->path, file->canonical, *file->text);
    auto text = read_text(file->path);
    if (!text) return text.status().at(directive.location.with_line());
    if (text->size() <= largest_kept_text && kept_text_bytes_ + text->size() <= max_kept_text) {
        kept_text_bytes_ += text->size();
        file->text = *text;
    }
    return read_file(file->path, file->canonical, std::move(*text));
}

// Import is an Include that leaves the graphics state as it was.
Status PbrtReader::import(const Directive& directive) {
    seems_version(4);
    const GraphicsState before = state_;
    const size_t depth = saved_.size();
    RAYPAGER_TRY(include(directive));
    if (saved_.size() != depth) return error(directive, "the file begins and ends attributes unevenly");
    state_ = before;
    return {};
}

Status PbrtReader::world_begin(const Directive&) {
    world_begun_ = true;
    state_.transform = Transform();
    coordinate_systems_["world"] = Transform();
    transforms_active_ = true;
    return {};
}

Status PbrtReader::world_end(const Directive&) {
    seems_version(3);
    world_ended_ = true;
    return {};
}

const char* PbrtReader::scope_name(Scope scope) {
    constexpr const char* names[] = {"Attribute", "Transform", "Object"};
    return names[static_cast<size_t>(scope)];
}

Status PbrtReader::push(const Directive& directive, Scope scope) {
    if (saved_.size() >= deepest_state) return error(directive, fmt::format("nested more than {} deep", deepest_state));
    saved_.push_back({state_, scope, directive.location, scope != Scope::transform});
    return {};
}

// Version 4 has one stack of states. Version 3 has one of transforms, and one of the rest that transforms have no part in; neither version 3 nor
// what is done here for version 4 asks whether an attribute or an object began what ends.
void PbrtReader::pop(const Directive& directive, Scope scope) {
    const auto last = [&](bool SavedState::*holds) {
        const auto found = std::find_if(saved_.rbegin(), saved_.rend(), [&](const SavedState& s) { return s.*holds; });
        return found == saved_.rend() ? nullptr : &*found;
    };
    SavedState* const transform = version_ == 3 ? last(&SavedState::holds_transform) : saved_.empty() ? nullptr : &saved_.back();
    SavedState* const rest = version_ == 3 ? scope == Scope::transform ? nullptr : last(&SavedState::holds_rest) : transform;
    if (scope == Scope::transform && version_ == 3 ? !transform : !rest) {
        warn(directive.location, fmt::format("{} without a beginning is ignored", directive.name));
        return;
    }
    if (((rest ? rest->scope : scope) == Scope::object) != (scope == Scope::object) && !odd_nesting_) {
        odd_nesting_ = fmt::format("{} before the end of the {}Begin in line {}; it is taken as pbrt-v3 would", directive.name,
                                   scope_name(rest->scope), rest->location.line);
        odd_nesting_location_ = directive.location;
    }
    const Transform before = transform ? transform->state.transform : state_.transform;
    if (rest) {
        state_ = rest->state;
        rest->holds_rest = false;
    }
    state_.transform = before;
    if (transform) transform->holds_transform = false;
    if (version_ != 3) saved_.pop_back();
    while (!saved_.empty() && !saved_.back().holds_transform && !saved_.back().holds_rest) saved_.pop_back();
}

Status PbrtReader::attribute_begin(const Directive& directive) { return push(directive, Scope::attribute); }
Status PbrtReader::attribute_end(const Directive& directive) {
    pop(directive, Scope::attribute);
    return {};
}
Status PbrtReader::transform_begin(const Directive& directive) { return push(directive, Scope::transform); }
Status PbrtReader::transform_end(const Directive& directive) {
    pop(directive, Scope::transform);
    return {};
}

Status PbrtReader::reverse_orientation(const Directive&) {
    state_.reverse_orientation = !state_.reverse_orientation;
    return {};
}

}  // namespace raypager
