// What all threads do together with the points of a cloud as they come.
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <span>

#include "base/kept_pieces.hpp"
#include "clouds/point_cloud.hpp"

namespace raypager {

// What a thread takes of them at a time.
inline constexpr size_t intake_piece = size_t{1} << 12;

// Moves points into the world.
class PointPlacer {
public:
    explicit PointPlacer(const PointRules& rules) : rules_(rules) {}
    // Appends those of them that are seen, in order. An error is that of the first point that has one.
    Status place(std::span<const CloudPoint> points, UnwrittenVector<CloudPoint>& placed);

    // Of all points so far.
    uint64_t culled() const { return culled_; }
    // Of all that are seen.
    const Box& bounds() const { return bounds_; }
    bool needs_spacing() const { return needs_spacing_; }  // some of them do

private:
    const PointRules& rules_;
    uint64_t culled_ = 0;
    Box bounds_;
    bool needs_spacing_ = false;
};

// Appends what make(i, issues) returns, a std::optional<T>, for each i below count, in order, without what is nothing.
template <class T, class Make>
void append_made(UnwrittenVector<T>& items, size_t count, MeshIssues& issues, const Make& make) {
    std::mutex mutex;
    append_kept(items, count, intake_piece, [&](size_t begin, size_t end, T* place) {
        const T* const first = place;
        MeshIssues found;
        for (size_t i = begin; i < end; i++)
            if (const auto made = make(i, found)) *place++ = *made;
        const std::lock_guard lock(mutex);
        issues.add(found);
        return static_cast<size_t>(place - first);
    });
}

}  // namespace raypager
