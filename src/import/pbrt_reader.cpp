#include "import/pbrt_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/files.hpp"
#include "import/materials.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// Bounds against hostile files, far beyond honest ones.
constexpr size_t deepest_include = 32, deepest_state = 4096;
constexpr uint64_t most_includes = 50000;

struct Unsupported {
    std::string_view directive, instead;
};
constexpr Unsupported unsupported[] = {
    {"PixelFilter", "pixels are averaged with a box filter"},
    {"Accelerator", "raypager builds its own hierarchy"},
    {"ColorSpace", "colours are taken as sRGB"},
    {"Option", "it is ignored"},
    {"Attribute", "the defaults that it sets are ignored"},
    {"MakeNamedMedium", "there are no participating media"},
    {"MediumInterface", "there are no participating media"},
    {"CameraMedium", "there are no participating media"},
    {"TransformTimes", "the scene does not move"},
    {"SurfaceIntegrator", "path tracing is used"},
    {"VolumeIntegrator", "path tracing is used"},
    {"Renderer", "path tracing is used"},
    {"Volume", "there are no participating media"},
};

}  // namespace

void PbrtWarnings::add(const PbrtPlace& place, const std::string& text) {
    const auto [at, added] = by_text_.try_emplace(text, entries_.size());
    if (added) entries_.push_back({place.with_line(), text, 0});
    ++entries_[at->second].count;
}

std::vector<std::string> PbrtWarnings::lines() const {
    std::vector<std::string> lines;
    for (const Entry& e : entries_)
        lines.push_back(e.count == 1 ? fmt::format("{}: {}", e.place, e.text)
                                     : fmt::format("{}: {} (and {} more of the same)", e.place, e.text, e.count - 1));
    return lines;
}

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
    RAYPAGER_TRY(read_file(path));
    if (!any_known_) return Status::failed(path.string() + ": holds no directive of pbrt; is it a pbrt scene?");
    if (!saved_.empty())
        return Status::failed(fmt::format("{}: {}Begin without {}End; the file is truncated or damaged", saved_.back().place.with_line(),
                                          scope_name(saved_.back().scope), scope_name(saved_.back().scope)));
    if (const Status placed = place_camera(); !placed.ok()) return placed.at(path.string());
    scene_.warnings = warnings_.lines();
    if (scene_.shapes.empty()) scene_.warnings.push_back(path.string() + ": there are no shapes to render");
    if (scene_.lights.empty() && scene_.area_lights.empty())
        scene_.warnings.push_back(path.string() + ": there is no light; the picture will be black");
    if (const Status valid = validate(scene_); !valid.ok()) return valid.at(path.string());
    return std::move(scene_);
}

Status PbrtReader::read_file(const std::filesystem::path& path) {
    auto text = read_text(path);
    if (!text) return text.status();
    const bool blank = std::all_of(text->begin(), text->end(), [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
    if (blank) return Status::failed(path.string() + ": is empty");
    scene_.files.push_back(path.string());
    std::error_code ignored;
    open_files_.push_back({path, std::filesystem::canonical(path, ignored)});
    PbrtTokens tokens(path, std::move(*text));
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
        const Directive directive{token->text, tokens_->place(*token)};
        tokens_->take();
        const auto handler = handlers().find(directive.name);
        any_known_ = any_known_ || handler != handlers().end();
        RAYPAGER_TRY(handler == handlers().end() ? skip_unsupported(directive) : (this->*handler->second)(directive));
    }
}

Status PbrtReader::skip_unsupported(const Directive& directive) {
    std::string_view instead = "it and its parameters are skipped";
    for (const Unsupported& u : unsupported)
        if (u.directive == directive.name) instead = u.instead;
    warn(directive.place, fmt::format("{} is not supported; {}", clipped(directive.name), instead));
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

Status PbrtReader::take_parameters(PbrtParameters& parameters) { return PbrtParameters::parse(*tokens_, parameters); }

Status PbrtReader::take_type_and_parameters(std::string& type, PbrtParameters& parameters) {
    RAYPAGER_TRY(take_string(type));
    return take_parameters(parameters);
}

Status PbrtReader::error(const Directive& directive, const std::string& what) const {
    return Status::failed(fmt::format("{}: {}: {}", directive.place.with_column(), directive.name, what));
}

void PbrtReader::warn_if_present(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const char* instead) {
    for (const std::string_view name : names)
        if (const PbrtParameter* p = parameters.find(name)) warn(p->place, fmt::format("parameter \"{}\" is not supported; {}", name, instead));
}

// Relative names count from the file that is being read, or else from the scene file, as pbrt does it.
Status PbrtReader::find_file(const std::string& name, std::filesystem::path& path) const {
    const std::filesystem::path wanted(name);
    if (name.empty() || name.find('\0') != std::string::npos) return Status::failed("the name of a file is missing");
    path = open_files_.back().path.parent_path() / wanted;  // absolute names stay as they are
    std::error_code ignored;
    const auto from_scene = open_files_.front().path.parent_path() / wanted;
    if (!std::filesystem::exists(path, ignored) && std::filesystem::exists(from_scene, ignored)) path = from_scene;
    return {};
}

Status PbrtReader::include(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    std::filesystem::path path;
    if (const Status found = find_file(name, path); !found.ok()) return error(directive, found.message());
    if (open_files_.size() >= deepest_include) return error(directive, fmt::format("files include each other more than {} deep", deepest_include));
    if (++included_ > most_includes) return error(directive, fmt::format("more than {} files are included", most_includes));
    std::error_code ignored;
    const auto canonical = std::filesystem::canonical(path, ignored);  // empty if there is no such file
    for (const OpenFile& open : open_files_)
        if (!canonical.empty() && open.canonical == canonical) return error(directive, fmt::format("{} includes itself", path.string()));
    const Status status = read_file(path);
    // A file that cannot be opened is an error of this line; errors inside it name their own place.
    return !status.ok() && status.message().starts_with(path.string() + ": ") ? status.at(directive.place.with_line()) : status;
}

// Import is an Include that leaves the graphics state as it was.
Status PbrtReader::import(const Directive& directive) {
    const GraphicsState before = state_;
    const size_t depth = saved_.size();
    RAYPAGER_TRY(include(directive));
    if (saved_.size() != depth) return error(directive, "the file begins and ends attributes unevenly");
    state_ = before;
    return {};
}

Status PbrtReader::world_begin(const Directive&) {
    state_.transform = Transform();
    coordinate_systems_["world"] = Transform();
    transforms_active_ = true;
    return {};
}

Status PbrtReader::world_end(const Directive&) { return {}; }

const char* PbrtReader::scope_name(Scope scope) {
    constexpr const char* names[] = {"Attribute", "Transform", "Object"};
    return names[static_cast<size_t>(scope)];
}

Status PbrtReader::push(const Directive& directive, Scope scope) {
    if (saved_.size() >= deepest_state) return error(directive, fmt::format("nested more than {} deep", deepest_state));
    saved_.push_back({state_, scope, directive.place});
    return {};
}

Status PbrtReader::pop(const Directive& directive, Scope scope) {
    if (saved_.empty()) return error(directive, fmt::format("without {}Begin", scope_name(scope)));
    const SavedState& open = saved_.back();
    if (open.scope != scope)
        return error(directive, fmt::format("before the end of the {}Begin in {}", scope_name(open.scope), open.place.with_line()));
    if (scope == Scope::transform)
        state_.transform = open.state.transform;
    else
        state_ = open.state;
    saved_.pop_back();
    return {};
}

Status PbrtReader::attribute_begin(const Directive& directive) { return push(directive, Scope::attribute); }
Status PbrtReader::attribute_end(const Directive& directive) { return pop(directive, Scope::attribute); }
Status PbrtReader::transform_begin(const Directive& directive) { return push(directive, Scope::transform); }
Status PbrtReader::transform_end(const Directive& directive) { return pop(directive, Scope::transform); }

Status PbrtReader::reverse_orientation(const Directive&) {
    state_.reverse_orientation = !state_.reverse_orientation;
    return {};
}

}  // namespace raypager
