#include "raypager/film_layers.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace raypager {
namespace {

struct LayerFacts {
    std::string_view name;
    std::vector<std::string> channels;
};

const std::array<LayerFacts, film_layer_count>& layer_facts() {
    static const std::array<LayerFacts, film_layer_count> facts = {{{"albedo", {"albedo.R", "albedo.G", "albedo.B"}},
                                                                    {"normal", {"N.X", "N.Y", "N.Z"}},
                                                                    {"depth", {"Z"}},
                                                                    {"position", {"position.X", "position.Y", "position.Z"}},
                                                                    {"object", {"object"}},
                                                                    {"instance", {"instance"}},
                                                                    {"material", {"material"}},
                                                                    {"samples", {"samples"}},
                                                                    {"variance", {"variance"}},
                                                                    {"waits", {"waits"}}}};
    return facts;
}

const LayerFacts& facts_of(FilmLayer layer) { return layer_facts()[static_cast<uint32_t>(layer)]; }

}  // namespace

std::string_view film_layer_name(FilmLayer layer) { return facts_of(layer).name; }
std::vector<std::string> film_layer_channels(FilmLayer layer) { return facts_of(layer).channels; }

Result<FilmLayer> film_layer_named(std::string_view name) {
    for (uint32_t i = 0; i < film_layer_count; i++)
        if (layer_facts()[i].name == name) return static_cast<FilmLayer>(i);
    return Status::usage(fmt::format("'{}' is not a layer; there are {}, and all", name, film_layer_list(FilmLayers(~0u))));
}

Result<FilmLayers> parse_film_layers(std::string_view list) {
    if (list == "all") return FilmLayers((1u << film_layer_count) - 1);
    FilmLayers layers;
    for (size_t begin = 0; begin <= list.size();) {
        const size_t end = std::min(list.find(',', begin), list.size());
        const std::string_view word = list.substr(begin, end - begin);
        const auto layer = film_layer_named(word);
        if (!layer) return layer.status();
        layers.add(*layer);
        begin = end + 1;
    }
    return layers;
}

std::string film_layer_list(const FilmLayers& layers) {
    std::string list;
    for (uint32_t i = 0; i < film_layer_count; i++)
        if (layers.has(static_cast<FilmLayer>(i))) list += fmt::format("{}{}", list.empty() ? "" : ",", layer_facts()[i].name);
    return list;
}

}  // namespace raypager
