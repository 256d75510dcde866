#include "import/cloud_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <new>

#include "base/kept_pieces.hpp"
#include "base/reused_memory.hpp"
#include "import/endings.hpp"
#include "import/geographic.hpp"
#include "import/origin.hpp"
#include "import/vertex_points.hpp"

namespace raypager {
namespace {

enum class CloudFormat { las, laz, ply, off, obj, text };

std::optional<CloudFormat> cloud_format(const std::filesystem::path& path) {
    const std::string ending = format_ending(path);
    if (ending == ".las") return CloudFormat::las;
    if (ending == ".laz") return CloudFormat::laz;
    if (ending == ".ply") return CloudFormat::ply;
    if (ending == ".off") return CloudFormat::off;
    if (ending == ".obj") return CloudFormat::obj;
    if (ending == ".xyz" || ending == ".pts" || ending == ".txt" || ending == ".asc" || ending == ".csv" || ending == ".xyzrgb")
        return CloudFormat::text;
    return std::nullopt;
}

// What is looked at to choose colours, origin and camera: so many parts of the file, so many points of each.
constexpr uint64_t sample_parts = 256;
constexpr size_t sample_points = 1024;

// What a thread reads of a file of records at a time, at most.
constexpr size_t piece_points = 4096, piece_bytes = size_t{512} << 10;

// How many such pieces all threads read before they are handed on: of large files several for each thread, as beginning together and waiting for the
// last one takes a while; but a small share of the file.
size_t pieces_at_once(uint64_t pieces) {
    constexpr uint64_t fewest = 32, of_thread = 8, share = 64;
    return static_cast<size_t>(std::clamp<uint64_t>(pieces / share, fewest, std::max(fewest, of_thread * worker_count())));
}

struct Scratch {
    std::vector<std::byte> bytes;
    std::vector<FilePoint> points;
};

std::vector<FilePoint> take_sample(const PointReader& reader, const InputFile& file) {
    std::vector<FilePoint> points;
    for (uint64_t part = 0; part < sample_parts; ++part) reader.sample(file, part, sample_parts, sample_points, points);
    return points;
}

FilePosition origin_of(const std::vector<FilePoint>& sample) {
    std::vector<FilePosition> positions;
    for (const FilePoint& p : sample) positions.push_back(p.position);
    return choose_origin(positions);
}

Result<std::unique_ptr<PointReader>> open_reader(const InputFile& file, CloudFormat format, const PointColumns& columns) {
    const std::string name = file.path().string();
    if (file.size() == 0) return Status::failed(name + ": is empty");
    if (format == CloudFormat::las) return open_las(file);
    if (format == CloudFormat::off) return open_off_points(file);
    if (format == CloudFormat::obj) return open_obj_points(file);
    if (format == CloudFormat::text) return open_text_points(file, columns);
    if (format == CloudFormat::laz)
        return Status::failed(name +
                              ": compressed points (LAZ) cannot be read here; unpack them, for instance with: laszip -i FILE.laz -o FILE.las; "
                              "or read them with Python: python -m raypager render FILE.laz (pip install 'raypager[las]')");
    auto header = read_ply_header(file);
    if (!header) return header.status();
    return open_ply_points(file, std::move(*header));
}

}  // namespace

Result<std::shared_ptr<const CloudFile>> CloudFile::open(const std::filesystem::path& path, const PointColumns& columns) {
    const auto format = cloud_format(path);
    if (!format) return Status::failed(path.string() + ": is no file of points; .las, .ply, .xyz, .pts and .txt can be read");
    const auto file = InputFile::open(path);
    if (!file) return file.status();
    auto reader = open_reader(*file, *format, columns);
    if (!reader) return reader.status();
    std::shared_ptr<CloudFile> cloud(new CloudFile(path, std::move(*reader)));
    const std::vector<FilePoint> sample = take_sample(*cloud->reader_, *file);
    cloud->colors_ = PointColors::choose(cloud->reader_->fields(), sample);
    cloud->origin_ = origin_of(sample);
    cloud->warnings_ = cloud->reader_->warnings();
    if (const std::string why = seems_geographic(sample, cloud->reader_->fields().geographic); !why.empty())
        cloud->warnings_.push_back(
            fmt::format("{}: {}, so the picture is out of proportion; project the points to metres first, for instance to UTM", path.string(), why));
    if (*format == CloudFormat::text) cloud->reading_ = point_column_list(columns);
    return std::shared_ptr<const CloudFile>(std::move(cloud));
}

size_t CloudFile::convert(std::span<const FilePoint> points, CloudPoint* place) const {
    const CloudPoint* const first = place;
    for (const FilePoint& p : points) {
        if (!is_usable(p.position)) continue;
        CloudPoint& point = *place++;
        point.position = {static_cast<float>(p.position[0] - origin_[0]), static_cast<float>(p.position[1] - origin_[1]),
                          static_cast<float>(p.position[2] - origin_[2])};
        point.radius = p.radius > 0 && p.radius <= static_cast<float>(largest_file_coordinate) ? p.radius : 0.0f;
        point.color = colors_.of(p);
    }
    return static_cast<size_t>(place - first);
}

Status CloudFile::stream_records(const RecordReader& reader, const InputFile& file, const std::function<Status(std::span<const CloudPoint>)>& take,
                                 MeshIssues& issues) const {
    const RecordRange& records = reader.records();
    const size_t piece = std::clamp<size_t>(piece_bytes / records.stride, 1, piece_points);
    const size_t at_once = pieces_at_once(records.count / piece) * piece;
    ReusedMemory<Scratch> scratch;
    UnwrittenVector<CloudPoint> converted;
    for (uint64_t first = 0; first < records.count; first += at_once) {
        const auto count = static_cast<size_t>(std::min<uint64_t>(records.count - first, at_once));
        std::atomic<uint64_t> not_finite{0};
        std::mutex mutex;
        Status status;
        converted.clear();
        append_kept(converted, count, piece, [&](size_t begin, size_t end, CloudPoint* place) {
            Scratch buffers = scratch.take();
            buffers.bytes.resize((end - begin) * records.stride);
            buffers.points.clear();
            const RecordRange part = records.part(first + begin, end - begin);
            if (auto read = file.read(part.offset, buffers.bytes); read.ok()) {
                reader.decode(buffers.bytes.data(), end - begin, buffers.points);
            } else {
                const std::lock_guard lock(mutex);
                status = std::move(read);
            }
            const size_t kept = convert(buffers.points, place);
            not_finite += buffers.points.size() - kept;
            scratch.give(std::move(buffers));
            return kept;
        });
        RAYPAGER_TRY(status);
        issues.not_finite += not_finite;
        if (!converted.empty()) RAYPAGER_TRY(take(converted));
    }
    return {};
}

Status CloudFile::stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const {
    const auto file = InputFile::open(path_);
    if (!file) return file.status();
    try {
        MeshIssues found;
        std::vector<CloudPoint> converted;
        const auto take_some = [&](std::span<const FilePoint> points) {
            converted.resize(points.size());
            converted.resize(convert(points, converted.data()));
            found.not_finite += points.size() - converted.size();
            return converted.empty() ? Status() : take(converted);
        };
        const RecordReader* const reader = reader_->by_record();
        RAYPAGER_TRY(reader ? stream_records(*reader, *file, take, found) : reader_->read(*file, take_some));
        issues.add(found);
        return {};
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory to read its points", path_.string()));
    }
}

Result<std::vector<CloudPoint>> CloudFile::sample() const {
    const auto file = InputFile::open(path_);
    if (!file) return file.status();
    const std::vector<FilePoint> points = take_sample(*reader_, *file);
    std::vector<CloudPoint> converted(points.size());
    converted.resize(convert(points, converted.data()));
    return converted;
}

bool is_cloud_file(const std::filesystem::path& path) {
    const auto format = cloud_format(path);
    if (format != CloudFormat::ply && format != CloudFormat::off && format != CloudFormat::obj) return format.has_value();
    const auto file = InputFile::open(path);
    if (!file) return false;
    if (format == CloudFormat::off) return is_point_off(*file);
    if (format == CloudFormat::obj) return is_point_obj(*file);
    const auto header = read_ply_header(*file);
    return header && is_point_ply(*header);
}

}  // namespace raypager
