// The parameter list of a pbrt directive: "type name" value, or "type name" [ values ].
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "import/pbrt_textures.hpp"
#include "import/pbrt_tokens.hpp"
#include "import/pbrt_warnings.hpp"
#include "raypager/scene.hpp"

namespace raypager {

struct PbrtParameter {
    std::string type, name;
    PbrtLocation location;
    std::vector<double> numbers;       // booleans are 0 or 1
    std::vector<std::string> strings;  // one of the two is empty
    mutable bool used = false;         // somebody asked for it
};

class PbrtParameters {
public:
    // Both must outlive the parameters.
    PbrtParameters(const PbrtTextures& textures, PbrtWarnings& warnings) : textures_(&textures), warnings_(&warnings) {}
    // Reads parameters until something else comes. Of those given twice the last one counts.
    Status parse(PbrtTokens& tokens);

    const PbrtParameter* find(std::string_view name) const;
    // The first that is there.
    const PbrtParameter* find(std::initializer_list<std::string_view> names) const;
    // The first that nobody has asked for yet, names of harmless ones apart.
    const PbrtParameter* find_unused(std::initializer_list<std::string_view> harmless) const;

    // Values, or fallback where the parameter is absent. A parameter of another type, or with too few values, is remembered as an error
    // that status() returns, so that a directive may read all that it wants and look once.
    // A texture gives the number that it is; one that is not defined the fallback, with a warning.
    double number(std::string_view name, double fallback) const;
    double number(std::initializer_list<std::string_view> names, double fallback) const;  // the first that is there
    uint32_t count(std::string_view name, uint32_t fallback, uint32_t largest) const;     // whole, 0 to largest
    bool boolean(std::string_view name, bool fallback) const;
    std::string text(std::string_view name, const std::string& fallback) const;
    std::array<double, 3> point(std::string_view name, const std::array<double, 3>& fallback) const;
    // x y z triples; empty if absent.
    std::vector<Float3> points(std::string_view name) const;
    std::vector<Float2> uvs() const;                             // "uv" or "st", pairs of u and v; empty if absent
    std::vector<uint32_t> indices(std::string_view name) const;  // negative ones become RP_NONE
    const Status& status() const { return error_; }

private:
    Status parse_one(PbrtTokens& tokens, const PbrtToken& token);
    void add(PbrtParameter parameter);
    double texture_number(const PbrtParameter& parameter, double fallback) const;
    void fail(const PbrtParameter& parameter, const std::string& what) const;

    std::vector<PbrtParameter> parameters_;
    const PbrtTextures* textures_;
    PbrtWarnings* warnings_;
    mutable Status error_;
};

// A parameter that does not say what it should, as file:line:column.
Status parameter_error(const PbrtParameter& parameter, const std::string& what);
// What stands for a texture that is not the same everywhere.
std::string texture_approximation(const std::string& type, const std::string& parameter);

}  // namespace raypager
