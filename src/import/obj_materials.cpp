#include "import/obj_materials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "import/line_reader.hpp"
#include "import/text.hpp"
#include "raypager/image_source.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

constexpr size_t max_materials = size_t{1} << 20;

float largest(const Float3& c) { return std::max({c.x, c.y, c.z}); }

// Whether an image is of normals, by the colour of its upper rows: nearly all that it says is "along the surface's own". Exporters write such images
// as map_Bump, which is for heights.
bool shows_normals(const ImageSource& image) {
    const auto shape = image.shape();
    if (!shape || shape->channels < 3 || (shape->kind != TexelKind::unsigned_8 && shape->kind != TexelKind::unsigned_16)) return false;
    std::array<double, 3> sum = {};
    size_t texels = 0;
    const size_t value_bytes = shape->kind == TexelKind::unsigned_8 ? 1 : 2;
    const auto add_rows = [&](std::span<const std::byte> rows) {
        for (size_t at = 0; at + shape->channels * value_bytes <= rows.size(); at += shape->channels * value_bytes, texels++)
            for (size_t c = 0; c < 3; c++) sum[c] += std::to_integer<int>(rows[at + (c + 1) * value_bytes - 1]) / 255.0;  // its high byte
        return Status::failed("enough was seen");
    };
    (void)image.read(add_rows);
    const auto mean = [&](size_t c) { return sum[c] / static_cast<double>(texels); };
    return texels > 0 && mean(2) > 0.75 && std::abs(mean(0) - 0.5) < 0.15 && std::abs(mean(1) - 0.5) < 0.15;
}

class LibraryReader {
public:
    LibraryReader(const InputFile& file, ObjLibraries& out)
        : name_(file.path().string()), folder_(file.path().parent_path()), lines_(file), out_(out) {}

    // Says how often lines made no sense, and which images are left out.
    Status read() {
        std::string_view line;
        for (bool end = false;;) {
            RAYPAGER_TRY(lines_.next(line, end));
            if (end) break;
            split_words(without_comment(line), words_);
            if (!words_.empty()) statement(line);
        }
        if (bad_lines_ > 0)
            out_.warnings.push_back(fmt::format("{}:{}: \"{}\" cannot be understood; {} such {} skipped", name_, first_bad_, bad_word_, bad_lines_,
                                                bad_lines_ == 1 ? "line is" : "lines are"));
        if (images_ > 0)
            out_.warnings.push_back(fmt::format("{}: {} left out: {} of a kind that is not supported, e.g. {}", name_,
                                                images_ == 1 ? "an image map is" : "image maps are", images_, first_image_));
        if (missing_ > 0)
            out_.warnings.push_back(fmt::format("{}: {} left out: {} cannot be found, e.g. {}", name_,
                                                missing_ == 1 ? "an image map is" : "image maps are", missing_, first_missing_));
        return {};
    }

private:
    void statement(std::string_view line) {
        std::string key(words_[0]);  // some writers care little about capitals
        std::transform(key.begin(), key.end(), key.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
        if (key == "newmtl") {
            named_ = out_.materials.size() < max_materials;
            if (!named_) return bad();
            out_.materials.emplace_back().name = name_behind_keyword(line);
            return;
        }
        if (!named_) return bad();
        ObjMaterial& m = out_.materials.back();
        if (key == "kd") return color(m.diffuse);
        if (key == "ks") return color(m.specular);
        if (key == "ke") return color(m.emission);
        if (key == "ns") return number(m.shininess);
        if (key == "ni") return number(m.ior);
        if (key == "d") return number(m.opacity, words_.size() > 1 && words_[1] == "-halo" ? 2 : 1);
        if (key == "tr") {
            double transparency = 1 - m.opacity;
            number(transparency);
            m.opacity = 1 - transparency;
            return;
        }
        if (key == "pr") return number(m.roughness.emplace(0.5));
        if (key == "pm") return number(m.metallic.emplace(0));
        if (key == "illum") {
            double model = -1;
            number(model);
            if (model >= 0 && model <= 10) m.illumination = static_cast<int>(model);
            return;
        }
        m.names_image = m.names_image || key == "map_kd";
        if (key == "map_kd") return image(line, m.diffuse_map);
        if (key == "map_ks") return image(line, m.specular_map);
        if (key == "map_pr") return image(line, m.roughness_map);
        if (key == "map_d") return image(line, m.opacity_map);
        if (key == "norm") return image(line, m.normal_map);
        if (key == "map_bump" || key == "bump") return bump(line, m);
        if (key.starts_with("map_") || key == "disp" || key == "decal" || key == "refl") leave_out_image();
        // All others say nothing that is used.
    }

    void leave_out_image() {
        if (images_++ == 0) first_image_ = fmt::format("\"{}\" {}", words_[0], clipped(words_.back()));
    }

    // Heights are left out: how much they are in the units of the model is not said.
    void bump(std::string_view line, ObjMaterial& m) {
        std::optional<ObjImage> found;
        image(line, found);
        if (!found) return;
        if (shows_normals(*image_file_source(found->path, {ImageEncoding::Kind::linear, 1})))
            m.normal_map = found;
        else
            leave_out_image();
    }

    void bad() {
        if (bad_lines_++ > 0) return;
        first_bad_ = lines_.line();
        bad_word_ = clipped(words_.front());
    }

    void number(double& value, size_t at = 1) {
        const auto parsed = at < words_.size() ? parse_number(words_[at]) : std::nullopt;
        if (!parsed || !std::isfinite(*parsed)) return bad();
        value = *parsed;
    }

    // Three numbers, or one for all.
    void color(std::optional<Float3>& value) {
        std::array<double, 3> c = {};
        const size_t numbers = words_.size() >= 4 ? 3 : 1;
        for (size_t i = 0; i < 3; ++i) {
            const size_t at = numbers == 3 ? i + 1 : 1;
            const auto parsed = at < words_.size() ? parse_number(words_[at]) : std::nullopt;
            if (!parsed || !(std::abs(*parsed) <= 1e9)) return bad();
            c[i] = std::max(*parsed, 0.0);
        }
        value = Float3{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
    }

    // Options, then a file name, which may have blanks in it.
    void image(std::string_view line, std::optional<ObjImage>& out) {
        ObjImage found;
        size_t at = 1;
        while (at + 1 < words_.size() && words_[at].size() > 1 && words_[at].front() == '-') {
            const std::string_view option = words_[at++];
            size_t values = option == "-mm" ? 2 : 1;
            if (option == "-s" || option == "-o" || option == "-t") {
                for (values = 0; values < 3 && at + values + 1 < words_.size() && parse_number(words_[at + values]); ++values) {
                    const double value = *parse_number(words_[at + values]);
                    if (values < 2 && option != "-t" && std::isfinite(value)) (option == "-s" ? found.scale : found.offset)[values] = value;
                }
            } else if (option == "-mm" && at + 1 < words_.size()) {
                found.base = parse_number(words_[at]).value_or(0);
                found.gain = parse_number(words_[at + 1]).value_or(1);
            } else if (option == "-clamp") {
                found.clamp = words_[at] == "on";
            } else if (option == "-imfchan") {
                const size_t channel = std::string_view("rgbm").find(words_[at].front());
                if (channel < 4) found.channel = static_cast<uint32_t>(channel) + 3;
            }
            at += values;
        }
        if (at >= words_.size()) return bad();
        std::string name(line.substr(static_cast<size_t>(words_[at].data() - line.data())));
        while (!name.empty() && is_blank(name.back())) name.pop_back();
        std::replace(name.begin(), name.end(), '\\', '/');
        std::error_code error;
        for (const std::filesystem::path& path : {folder_ / name, folder_ / std::filesystem::path(name).filename()})
            if (std::filesystem::is_regular_file(path, error)) {
                found.path = path;
                const auto shape = image_file_source(path, {})->shape();
                if (shape)
                    out = found;
                else
                    out_.warnings.push_back(shape.status().message() + "; the image is left out");
                return;
            }
        if (missing_++ == 0) first_missing_ = clipped(name);
    }

    const std::string name_;
    const std::filesystem::path folder_;
    LineReader lines_;
    ObjLibraries& out_;
    bool named_ = false;
    std::vector<std::string_view> words_;
    uint64_t bad_lines_ = 0, first_bad_ = 0, images_ = 0, missing_ = 0;
    std::string bad_word_, first_image_, first_missing_;
};

// A line may name one file or several, and names may hold blanks: the longest runs of words that are files.
std::vector<std::filesystem::path> split_names(const std::filesystem::path& folder, const std::string& names, std::vector<std::string>& missing) {
    const auto words = split_words(names);
    const auto found_at = [&](std::string name) -> std::optional<std::filesystem::path> {
        std::replace(name.begin(), name.end(), '\\', '/');
        if (name.size() > 1 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
        std::error_code error;
        for (const std::filesystem::path& path : {folder / name, folder / std::filesystem::path(name).filename()})
            if (std::filesystem::is_regular_file(path, error)) return path;
        return std::nullopt;
    };
    std::vector<std::filesystem::path> paths;
    constexpr size_t max_words = 32;
    for (size_t i = 0; i < std::min(words.size(), max_words);) {
        size_t end = std::min(words.size(), max_words);
        std::optional<std::filesystem::path> path;
        for (; end > i && !path; --end)
            path = found_at(std::string(words[i].data(), static_cast<size_t>(words[end - 1].data() + words[end - 1].size() - words[i].data())));
        if (path) {
            paths.push_back(*path);
            i = end + 1;
            continue;
        }
        missing.push_back(i == 0 && paths.empty() ? names : std::string(words[i]));
        if (i == 0) break;
        ++i;
    }
    return paths;
}

// Black, but for what a monitor would not show.
bool is_dark(const std::optional<Float3>& c) { return !c || largest(*c) < 0.05f; }

// Illumination models 0 and 1 have no highlights.
bool is_glossy(const ObjMaterial& m) {
    if (m.roughness) return true;
    return m.illumination != 0 && m.illumination != 1 && m.specular && largest(*m.specular) > 0 && m.shininess > 0;
}

// Of light that falls on a glossy surface straight. Programs write Ks for paint and plastic between 0.2 and 1, which is what it is multiplied by
// for the eye: taken as a share of light it would be metal. So 0.5 is the 4 % of plastic, as in Blender's exporter.
Float3 straight_reflection(const ObjMaterial& m) {
    if (!m.specular || largest(*m.specular) == 0) return {0.04f, 0.04f, 0.04f};
    const auto share = [](float c) { return 0.08f * std::min(c, 1.0f); };
    return {share(m.specular->x), share(m.specular->y), share(m.specular->z)};
}

}  // namespace

ObjLibraries read_obj_libraries(const std::filesystem::path& model, const std::vector<std::string>& libraries) {
    ObjLibraries out;
    std::vector<std::string> missing;
    std::set<std::string> read;  // whatever they are called
    for (const std::string& names : libraries)
        for (const auto& path : split_names(model.parent_path(), names, missing)) {
            std::error_code error;
            if (!read.insert(std::filesystem::weakly_canonical(path, error).string()).second) continue;
            const auto file = InputFile::open(path);
            const Status status = file ? LibraryReader(*file, out).read() : file.status();
            if (!status.ok()) out.warnings.push_back(status.message() + "; the rest of its materials is left out");
            out.files.push_back(path.string());
        }
    if (!missing.empty())
        out.warnings.push_back(fmt::format("{}: its material library {} cannot be found; what has those materials is shown as clay", model.string(),
                                           clipped(missing.front()) + (missing.size() > 1 ? fmt::format(" (and {} more)", missing.size() - 1) : "")));
    return out;
}

namespace {

// v goes upwards, rows of an image come from the top.
Texture texture_of(const ObjImage& image, const Float3& factor, ImageEncoding::Kind encoding) {
    rp_texture_map map{};
    map.kind = RP_MAP_UV;
    map.m[0] = static_cast<float>(image.scale[0]);
    map.m[2] = static_cast<float>(image.offset[0]);
    map.m[5] = -static_cast<float>(image.scale[1]);
    map.m[6] = 1 - static_cast<float>(image.offset[1]);
    const auto gain = static_cast<float>(image.gain), base = static_cast<float>(image.base);
    rp_texture_op op = texture_op(RP_TEXTURE_IMAGE, {gain * factor.x, gain * factor.y, gain * factor.z});
    const uint32_t wrap = image.clamp ? RP_WRAP_BLACK : RP_WRAP_REPEAT;
    op.op |= (wrap | wrap << 2) << RP_TEXTURE_WRAP_SHIFT | image.channel << RP_TEXTURE_CHANNEL_SHIFT;
    const Texture texel = Texture::image(image_file_source(image.path, {encoding, 1}), op, map);
    if (base == 0) return texel;
    return mixed(texel, Float3{factor.x, factor.y, factor.z}, Texture(double{base}));
}

}  // namespace

namespace {

TexturedMaterial smooth_material(const ObjMaterial& m) {
    // By the number of the illumination model, or by what can be seen through: glass.
    const bool glass_model = m.illumination == 4 || m.illumination == 6 || m.illumination == 7 || m.illumination == 9;
    if ((glass_model && (m.opacity < 1 || m.ior > 1)) || (m.opacity < 1 && m.ior > 1))
        return {dielectric_material(static_cast<float>(std::clamp(m.ior > 1 ? m.ior : 1.5, 1.0001, 10.0))), {}};
    const double phong = std::sqrt(2 / (std::max(m.shininess, 0.0) + 2));
    const auto alpha = [&](double rough) { return static_cast<float>(rough < 0.02 ? 0 : std::min(rough, 1.0)); };
    if (m.metallic.value_or(0) > 0.5 && m.diffuse && !m.diffuse_map) {
        const double roughness = m.roughness ? *m.roughness * *m.roughness : phong;
        return {conductor_of_reflectance(*m.diffuse, alpha(roughness)), {}};
    }
    // A metal has no colour but that of its reflection.
    const bool mirror_model = m.illumination == 3 || m.illumination == 5 || m.illumination == 8;
    const bool bright = m.specular && largest(*m.specular) > 0.2f;
    if (is_dark(m.diffuse) && m.diffuse && bright && !m.names_image && (mirror_model || m.shininess > 10))
        return {conductor_of_reflectance(*m.specular, mirror_model && m.shininess == 0 ? 0 : alpha(phong)), {}};
    // Under an image, colours are often black or left out.
    constexpr Float3 white = {1, 1, 1};
    const Float3 hidden = m.diffuse_map ? white : Float3{0.5f, 0.5f, 0.5f};
    const Float3 diffuse = m.names_image && is_dark(m.diffuse) ? hidden : m.diffuse.value_or(m.diffuse_map ? white : Float3{0.8f, 0.8f, 0.8f});
    const bool glossy = is_glossy(m) || m.specular_map || m.roughness_map;
    TexturedMaterial result;
    result.material = glossy ? glossy_material(diffuse, straight_reflection(m), alpha(m.roughness ? *m.roughness * *m.roughness : phong))
                             : diffuse_material(diffuse);
    if (m.diffuse_map) result.set(RP_PARAMETER_COLOR, texture_of(*m.diffuse_map, diffuse, ImageEncoding::Kind::automatic), result.material.color);
    if (m.specular_map)
        result.set(RP_PARAMETER_SPECULAR, texture_of(*m.specular_map, straight_reflection(m), ImageEncoding::Kind::automatic),
                   result.material.specular);
    if (m.roughness_map) {
        const Texture roughness = texture_of(*m.roughness_map, white, ImageEncoding::Kind::linear);
        result.textures.push_back({RP_PARAMETER_ALPHA, roughness * roughness});
    }
    if (result.textures.empty()) result.material = with_opacity(result.material, static_cast<float>(m.opacity));
    return result;
}

}  // namespace

TexturedMaterial engine_material(const ObjMaterial& m) {
    TexturedMaterial result = smooth_material(m);
    if (!m.normal_map || result.material.kind == RP_MATERIAL_MIX) return result;
    ObjImage normals = *m.normal_map;
    normals.base = 0, normals.gain = 1;
    result.textures.push_back({RP_PARAMETER_NORMAL, texture_of(normals, {1, 1, 1}, ImageEncoding::Kind::linear)});
    return result;
}

std::optional<Texture> cut_out_opacity(const ObjMaterial& m) {
    if (!m.opacity_map) return std::nullopt;
    ObjImage image = *m.opacity_map;
    // The alpha of an image that has one, else what is grey in it.
    constexpr uint32_t mean = 1, alpha = 6;
    const auto shape = image_file_source(image.path, {ImageEncoding::Kind::linear, 1})->shape();
    if (image.channel == 0) image.channel = shape && shape->has_alpha ? alpha : mean;
    return texture_of(image, {1, 1, 1}, ImageEncoding::Kind::linear);
}

std::optional<Float3> emitted_radiance(const ObjMaterial& material) {
    return material.emission && largest(*material.emission) > 0 ? material.emission : std::nullopt;
}

}  // namespace raypager
