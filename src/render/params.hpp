// What is rendered, by a scene and the options of a render, whatever the device.
#pragma once

#include "raypager/abi/scene.h"
#include "raypager/devices.hpp"
#include "render/checkpoint.hpp"
#include "render/render.hpp"

namespace raypager {

// All but slot_count.
Result<rp_render_params> make_params(const BakedScene& scene, const RenderOptions& options);
// What cannot be recorded.
Status check_instruments(const RenderOptions& options, const RenderInstruments& instruments);
RenderIdentity identity_of(const BakedScene& scene, const rp_render_params& params);
// The film lies in one buffer on the device, unless it may be there in parts; the finished picture lies in host memory.
Status check_picture_size(const rp_render_params& params, const DeviceInfo& device, bool film_in_parts);
// A film that is on the device in parts lies in host memory as a whole, with the part that is taken from the device, and with the finished picture.
uint64_t host_film_bytes(const rp_render_params& params);
Status check_host_film(const rp_render_params& params);

// Whether pictures are looked at before the end. Renders with a checkpoint are there to be stopped and looked at.
bool is_seen_growing(const RenderOptions& options);

}  // namespace raypager
