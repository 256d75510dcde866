// The textures of a scene file, by name.
#pragma once

#include <map>
#include <string>

#include "import/pbrt_tokens.hpp"
#include "import/textures.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct PbrtTexture {
    Texture value;
    std::string type;           // as the file has it
    bool approximated = false;  // the value is not what pbrt would have
    Status fault;               // of an image that cannot be read: an error where the texture is used
    PbrtLocation location;
};

// Float and spectrum textures have name spaces of their own: one of each kind may have the same name.
struct PbrtTextures {
    std::map<std::string, PbrtTexture, std::less<>> floats, spectra;
};

}  // namespace raypager
