#include "clouds/point_intake.hpp"

namespace raypager {

Status PointPlacer::place(std::span<const CloudPoint> points, UnwrittenVector<CloudPoint>& placed) {
    std::mutex mutex;
    Status status;
    size_t failed = SIZE_MAX;  // the piece that the status is of
    append_kept(placed, points.size(), intake_piece, [&](size_t begin, size_t end, CloudPoint* place) -> size_t {
        const CloudPoint* const first = place;
        Box bounds;
        bool needs_spacing = false;
        for (CloudPoint point : points.subspan(begin, end - begin)) {
            const auto is_seen = rules_.place(point);
            if (!is_seen) {
                const std::lock_guard lock(mutex);
                if (begin < failed) {
                    failed = begin;
                    status = is_seen.status();
                }
                return 0;
            }
            if (!*is_seen) continue;
            bounds.grow(point.position);
            needs_spacing |= rules_.needs_spacing(point);
            *place++ = point;
        }
        const auto kept = static_cast<size_t>(place - first);
        const std::lock_guard lock(mutex);
        culled_ += end - begin - kept;
        bounds_.grow(bounds);
        needs_spacing_ |= needs_spacing;
        return kept;
    });
    return status;
}

}  // namespace raypager
