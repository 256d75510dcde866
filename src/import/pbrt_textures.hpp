// The textures of a scene file, by name.
#pragma once

#include <map>
#include <string>

#include "import/pbrt_tokens.hpp"
#include "import/textures.hpp"

namespace raypager {

struct PbrtTexture {
    Texture value;
    std::string type;           // as the file has it
    bool approximated = false;  // the value is not what pbrt would have
    PbrtLocation location;
};

// Float and spectrum textures have name spaces of their own: one of each kind may have the same name.
struct PbrtTextures {
    std::map<std::string, PbrtTexture, std::less<>> floats, spectra;
};

}  // namespace raypager
