// The textures of a scene file: until there are image textures in the engine, each is one value.
#pragma once

#include <map>
#include <string>

#include "import/pbrt_tokens.hpp"
#include "raypager/scene.hpp"

namespace raypager {

template <class Value>
struct PbrtTexture {
    Value value{};
    std::string approximated;  // the type of a texture that is not the same everywhere; empty where the value is exact
    PbrtLocation location;
};

// Float and spectrum textures have name spaces of their own: one of each kind may have the same name.
struct PbrtTextures {
    std::map<std::string, PbrtTexture<double>, std::less<>> floats;
    std::map<std::string, PbrtTexture<Float3>, std::less<>> spectra;
};

}  // namespace raypager
