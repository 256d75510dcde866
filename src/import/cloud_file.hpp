// A point cloud in a file of its own.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <vector>

#include "import/point_colors.hpp"
#include "import/point_readers.hpp"
#include "raypager/scene.hpp"

namespace raypager {

class CloudFile final : public PointSource {
public:
    // Checks that the file exists, looks like its ending says and is as long as its header says; the rest is found out by stream().
    // columns: of text, what they are; empty: the file tells.
    static Result<std::shared_ptr<const CloudFile>> open(const std::filesystem::path& path, const PointColumns& columns = {});

    Status stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const override;
    uint64_t count() const override { return reader_->count(); }
    bool has_color() const override { return colors_.any(); }
    std::string name() const override { return path_.string(); }
    std::vector<std::string> files() const override { return {path_.string()}; }
    std::string reading() const override { return reading_; }
    // What is odd about it, or had to be guessed; a line each, with its name.
    const std::vector<std::string>& warnings() const { return warnings_; }

    // Surveyed coordinates are far from their origin, too far for single precision. Whole thousands are taken off each coordinate of all
    // points (in double precision) where that brings most of them nearer: a point of the file is what stream() hands on plus origin().
    const std::array<double, 3>& origin() const { return origin_; }
    // Points spread evenly over the file, some hundred thousand at most, the same each time.
    Result<std::vector<CloudPoint>> sample() const;
    bool z_up() const { return reader_->fields().z_up; }  // the format says so

private:
    CloudFile(std::filesystem::path path, std::unique_ptr<const PointReader> reader) : path_(std::move(path)), reader_(std::move(reader)) {}
    // Puts those of the points that are finite there; returns how many.
    size_t convert(std::span<const FilePoint> points, CloudPoint* place) const;
    // By all threads.
    Status stream_records(const RecordReader& reader, const InputFile& file, const std::function<Status(std::span<const CloudPoint>)>& take,
                          MeshIssues& issues) const;

    std::filesystem::path path_;
    std::unique_ptr<const PointReader> reader_;
    PointColors colors_;
    std::array<double, 3> origin_ = {0, 0, 0};
    std::string reading_;
    std::vector<std::string> warnings_;
};

// Whether the file is to be read as a cloud: by its ending, in either case and also before .gz, and where that is .ply by its header.
bool is_cloud_file(const std::filesystem::path& path);

}  // namespace raypager
