// Renders that are looked at in a browser: the verb 'view', and 'render --view'. Without RAYPAGER_VIEW there are none of them.
#pragma once

#include "cli/render_settings.hpp"
#include "raypager/blocks.hpp"
#include "raypager/session.hpp"

namespace raypager {

// As render(), with a page to watch it in as long as it runs; the page's address is printed. The picture is the same.
Result<RenderResult> render_in_view(const RenderSettings& settings, const Blocks& scene, const RenderOptions& options,
                                    const RenderCallbacks& callbacks);

}  // namespace raypager
