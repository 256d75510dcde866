#include "import/pbrt_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/text.hpp"

namespace raypager {
namespace {

enum class Values { numbers, strings, booleans, spectrum, anything };

struct TypeRule {
    std::string_view name;
    Values values;
    size_t group;  // the number of values is a multiple of this
};
constexpr TypeRule type_rules[] = {
    {"integer", Values::numbers, 1}, {"float", Values::numbers, 1},     {"point", Values::numbers, 3},     {"point2", Values::numbers, 2},
    {"point3", Values::numbers, 3},  {"vector", Values::numbers, 3},    {"vector2", Values::numbers, 2},   {"vector3", Values::numbers, 3},
    {"normal", Values::numbers, 3},  {"normal3", Values::numbers, 3},   {"rgb", Values::numbers, 3},       {"color", Values::numbers, 3},
    {"xyz", Values::numbers, 3},     {"blackbody", Values::numbers, 1}, {"spectrum", Values::spectrum, 1}, {"bool", Values::booleans, 1},
    {"string", Values::strings, 1},  {"texture", Values::strings, 1},
};

const TypeRule* find_rule(std::string_view type) {
    for (const TypeRule& rule : type_rules)
        if (rule.name == type) return &rule;
    return nullptr;
}

constexpr TypeRule unknown_type = {"", Values::anything, 1};

// Takes one value of a parameter off tokens.
Status parse_value(PbrtTokens& tokens, Values values, PbrtParameter& parameter) {
    const PbrtToken* token = nullptr;
    RAYPAGER_TRY(tokens.peek(token));
    if (values == Values::anything && token->kind == PbrtTokenKind::number) values = Values::numbers;
    if (values == Values::anything && token->kind == PbrtTokenKind::string) values = Values::strings;
    if (values == Values::anything) values = Values::booleans;
    const bool numbers = values == Values::numbers || values == Values::spectrum, strings = values == Values::strings || values == Values::spectrum;
    const bool boolean = token->text == "true" || token->text == "false";
    const bool zero_or_one = token->kind == PbrtTokenKind::number && (token->number == 0 || token->number == 1);
    if ((numbers && token->kind == PbrtTokenKind::number && parameter.strings.empty()) || (values == Values::booleans && zero_or_one)) {
        parameter.numbers.push_back(token->number);
    } else if (strings && token->kind == PbrtTokenKind::string && parameter.numbers.empty()) {
        parameter.strings.push_back(token->text);
    } else if (values == Values::booleans && boolean && (token->kind == PbrtTokenKind::string || token->kind == PbrtTokenKind::word)) {
        parameter.numbers.push_back(token->text == "true");
    } else {
        constexpr const char* wanted[] = {"a number", "a string", "true or false", "numbers or a name"};
        return tokens.error(*token, fmt::format("expected {} for \"{} {}\" instead of {}", wanted[static_cast<size_t>(values)], parameter.type,
                                                clipped(parameter.name), token->describe()));
    }
    tokens.take();
    return {};
}

// One value, or any number of them in brackets.
Status parse_values(PbrtTokens& tokens, const TypeRule& rule, PbrtParameter& parameter) {
    const PbrtToken* token = nullptr;
    RAYPAGER_TRY(tokens.peek(token));
    if (token->kind != PbrtTokenKind::open) {
        RAYPAGER_TRY(parse_value(tokens, rule.values, parameter));
    } else {
        tokens.take();
        while (true) {
            RAYPAGER_TRY(tokens.peek(token));
            if (token->kind == PbrtTokenKind::close) break;
            RAYPAGER_TRY(parse_value(tokens, rule.values, parameter));
        }
        tokens.take();
    }
    return {};
}

}  // namespace

Status parameter_error(const PbrtParameter& parameter, const std::string& what) {
    return Status::failed(
        fmt::format("{}: parameter \"{} {}\": {}", parameter.location.with_column(), clipped(parameter.type), clipped(parameter.name), what));
}

std::string texture_approximation(const std::string& type, const std::string& parameter) {
    return fmt::format("Texture \"{}\" is not supported for \"{}\"; one mid value is used", clipped(type), clipped(parameter));
}

Status PbrtParameters::parse(PbrtTokens& tokens) {
    while (true) {
        const PbrtToken* token = nullptr;
        RAYPAGER_TRY(tokens.peek(token));
        if (token->kind == PbrtTokenKind::word || token->kind == PbrtTokenKind::end) return {};
        if (token->kind != PbrtTokenKind::string)
            return tokens.error(*token, fmt::format("expected \"type name\" of a parameter, or a directive, instead of {}", token->describe()));
        RAYPAGER_TRY(parse_one(tokens, *token));
    }
}

Status PbrtParameters::parse_one(PbrtTokens& tokens, const PbrtToken& token) {
    const auto words = split_words(token.text);
    if (words.size() != 2) return tokens.error(token, fmt::format("expected \"type name\" of a parameter instead of \"{}\"", clipped(token.text)));
    PbrtParameter parameter;
    parameter.type = words[0];
    parameter.name = words[1];
    parameter.location = tokens.location(token);
    tokens.take();

    const TypeRule* rule = find_rule(parameter.type);
    RAYPAGER_TRY(parse_values(tokens, rule ? *rule : unknown_type, parameter));
    if (!rule) {
        warnings_->add(parameter.location, fmt::format("\"{}\" is no type of parameter; it is ignored", clipped(parameter.type)));
        return {};
    }
    if (const size_t excess = parameter.numbers.size() % rule->group; excess != 0) {
        warnings_->add(parameter.location, fmt::format("parameter \"{} {}\" expects values in groups of {}; the last {} of {} are ignored",
                                                       parameter.type, clipped(parameter.name), rule->group, excess, parameter.numbers.size()));
        parameter.numbers.resize(parameter.numbers.size() - excess);
    }
    if (parameter.numbers.empty() && parameter.strings.empty()) return {};  // as if it were not there
    add(std::move(parameter));
    return {};
}

void PbrtParameters::add(PbrtParameter parameter) {
    for (PbrtParameter& p : parameters_)
        if (p.name == parameter.name) {
            // A texture is looked for before a value is, whatever their order.
            const bool stays = p.type == "texture" && parameter.type != "texture";
            if (p.type != parameter.type || p.numbers != parameter.numbers || p.strings != parameter.strings)
                warnings_->add(parameter.location, fmt::format("parameter \"{}\" is given twice; {} counts", clipped(parameter.name),
                                                               stays ? "the texture" : "the last one"));
            if (!stays) p = std::move(parameter);
            return;
        }
    parameters_.push_back(std::move(parameter));
}

const PbrtParameter* PbrtParameters::find(std::string_view name) const {
    for (const PbrtParameter& p : parameters_)
        if (p.name == name) {
            p.used = true;
            return &p;
        }
    return nullptr;
}

const PbrtParameter* PbrtParameters::find(std::initializer_list<std::string_view> names) const {
    for (const std::string_view name : names)
        if (const PbrtParameter* p = find(name)) return p;
    return nullptr;
}

const PbrtParameter* PbrtParameters::find_unused(std::initializer_list<std::string_view> harmless) const {
    for (const PbrtParameter& p : parameters_)
        if (!p.used && std::find(harmless.begin(), harmless.end(), p.name) == harmless.end()) return &p;
    return nullptr;
}

void PbrtParameters::fail(const PbrtParameter& parameter, const std::string& what) const {
    if (error_.ok()) error_ = parameter_error(parameter, what);
}

double PbrtParameters::number(std::string_view name, double fallback) const {
    const PbrtParameter* p = find(name);
    if (!p) return fallback;
    if (p->type == "texture" && p->strings.size() == 1) return texture_number(*p, fallback);
    if (p->numbers.size() == 1 && p->type != "bool") return p->numbers[0];
    // Three equal numbers of a colour are one.
    if (p->numbers.size() == 3 && p->numbers[0] == p->numbers[1] && p->numbers[1] == p->numbers[2]) return p->numbers[0];
    fail(*p, "expected one number");
    return fallback;
}

double PbrtParameters::number(std::initializer_list<std::string_view> names, double fallback) const {
    for (const std::string_view name : names)
        if (find(name)) return number(name, fallback);
    return fallback;
}

double PbrtParameters::texture_number(const PbrtParameter& p, double fallback) const {
    const auto texture = textures_->floats.find(p.strings[0]);
    if (texture == textures_->floats.end()) {
        warnings_->add(p.location,
                       fmt::format("there is no float texture \"{}\"; \"{}\" stays at its default", clipped(p.strings[0]), clipped(p.name)));
        return fallback;
    }
    if (error_.ok()) error_ = texture->second.fault;
    if (texture->second.approximated || !texture->second.value.is_constant())
        warnings_->add(texture->second.location, texture_approximation(texture->second.type, p.name));
    return texture->second.value.mean_number();
}

uint32_t PbrtParameters::count(std::string_view name, uint32_t fallback, uint32_t largest) const {
    const double value = number(name, fallback);
    if (value >= 0 && value <= largest && value == std::floor(value)) return static_cast<uint32_t>(value);
    fail(*find(name), fmt::format("expected a whole number from 0 to {} instead of {}", largest, value));
    return fallback;
}

bool PbrtParameters::boolean(std::string_view name, bool fallback) const {
    const PbrtParameter* p = find(name);
    if (!p) return fallback;
    if (p->numbers.size() == 1 && (p->numbers[0] == 0 || p->numbers[0] == 1)) return p->numbers[0] != 0;
    if (p->strings.size() == 1 && (p->strings[0] == "true" || p->strings[0] == "false")) return p->strings[0] == "true";
    fail(*p, "expected one of true and false");
    return fallback;
}

std::string PbrtParameters::text(std::string_view name, const std::string& fallback) const {
    const PbrtParameter* p = find(name);
    if (!p) return fallback;
    if (p->strings.size() == 1) return p->strings[0];
    fail(*p, "expected one string");
    return fallback;
}

std::array<double, 3> PbrtParameters::point(std::string_view name, const std::array<double, 3>& fallback) const {
    const PbrtParameter* p = find(name);
    if (!p) return fallback;
    if (p->numbers.size() == 3) return {p->numbers[0], p->numbers[1], p->numbers[2]};
    fail(*p, "expected three numbers");
    return fallback;
}

std::vector<Float3> PbrtParameters::points(std::string_view name) const {
    std::vector<Float3> result;
    const PbrtParameter* p = find(name);
    if (!p) return result;
    if (p->numbers.size() % 3 != 0) {
        fail(*p, "expected triples of numbers");
        return result;
    }
    result.reserve(p->numbers.size() / 3);
    for (size_t i = 0; i < p->numbers.size(); i += 3)
        result.push_back({static_cast<float>(p->numbers[i]), static_cast<float>(p->numbers[i + 1]), static_cast<float>(p->numbers[i + 2])});
    return result;
}

// Whatever may be wrong with these, the surface is the same.
std::vector<Float2> PbrtParameters::uvs() const {
    std::vector<Float2> result;
    const PbrtParameter* p = find({"uv", "st"});
    if (!p) return result;
    result.reserve(p->numbers.size() / 2);
    for (size_t i = 0; i + 1 < p->numbers.size(); i += 2)
        result.push_back({static_cast<float>(p->numbers[i]), static_cast<float>(p->numbers[i + 1])});
    return result;
}

std::vector<uint32_t> PbrtParameters::indices(std::string_view name) const {
    std::vector<uint32_t> result;
    const PbrtParameter* p = find(name);
    if (!p) return result;
    if (!p->strings.empty()) fail(*p, "expected whole numbers");
    result.reserve(p->numbers.size());
    for (const double value : p->numbers) {
        if (value != std::floor(value)) {
            fail(*p, fmt::format("expected whole numbers, but one is {}", value));
            return {};
        }
        result.push_back(value < 0 || value > 0xfffffffe ? RP_NONE : static_cast<uint32_t>(value));
    }
    return result;
}

}  // namespace raypager
