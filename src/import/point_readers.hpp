// Readers of single point files. Each hands on what its file says, in the file's order; point_colors.hpp says what the colours mean, and
// cloud_file.hpp makes a PointSource of both. Memory is bounded, whatever a header claims.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.hpp"
#include "import/origin.hpp"
#include "import/ply_header.hpp"
#include "import/point_columns.hpp"

namespace raypager {

inline constexpr size_t points_at_once = 4096;  // that a reader of text hands on

// A point as its file has it. What the file has not is 0.
struct FilePoint {
    std::array<double, 3> position = {0, 0, 0};  // may be anything, not finite included
    std::array<float, 3> color = {0, 0, 0};      // red, green, blue in the file's own scale
    float intensity = 0;
    float radius = 0;
    uint8_t classification = 0;  // ASPRS standard point classes
};

enum class ColorType {
    byte,   // 0 to 255
    word,   // 0 to 65535, or to 255 by the many writers that do not widen their bytes
    number  // 0 to 1, 0 to 255 or 0 to 65535
};

// What the points of a file have beside a position.
struct PointFields {
    bool color = false, intensity = false, classification = false;
    ColorType color_type = ColorType::byte;
    bool z_up = false;        // the format is one of surveying
    bool geographic = false;  // coordinates are longitude and latitude, the file says
};

class RecordReader;

class PointReader {
public:
    using Take = std::function<Status(std::span<const FilePoint>)>;
    virtual ~PointReader() = default;
    virtual uint64_t count() const = 0;  // at most so many points come
    virtual PointFields fields() const = 0;
    // What is odd about the file, or had to be guessed; a line each, with the file's name.
    virtual std::vector<std::string> warnings() const { return {}; }
    // All points, in pieces of some thousand. A status that take returns ends the reading and is passed on.
    virtual Status read(const InputFile& file, const Take& take) const = 0;
    // Appends up to `most` points from the start of one of `parts` equal parts of the file. What is damaged there is left out: read() will say.
    virtual void sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const = 0;
    // Of a file that can be read from several places at once; null: of another.
    virtual const RecordReader* by_record() const { return nullptr; }
};

// Fixed-size records one after another in a file.
struct RecordRange {
    uint64_t offset = 0, count = 0;
    size_t stride = 0;  // bytes, more than 0
    // So many of them from the first-th on. REQUIRES: there are as many.
    RecordRange part(uint64_t first, uint64_t number) const { return {offset + first * stride, number, stride}; }
};

// Of files whose points are such records.
class RecordReader : public PointReader {
public:
    uint64_t count() const final { return records_.count; }
    const RecordRange& records() const { return records_; }
    // Appends the points of so many records. Any number of threads at once.
    virtual void decode(const std::byte* record, size_t count, std::vector<FilePoint>& points) const = 0;

    Status read(const InputFile& file, const Take& take) const final;
    void sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const final;
    const RecordReader* by_record() const final { return this; }

protected:
    explicit RecordReader(const RecordRange& records) : records_(records) {}

private:
    const RecordRange records_;
};

// LAS 1.0 to 1.4, point formats 0 to 10, not compressed (specification: ASPRS, LAS 1.4 R15). Withheld points and noise (classes 7 and 18)
// are left out.
Result<std::unique_ptr<PointReader>> open_las(const InputFile& file);
// PLY whose vertices are points, in any encoding. Properties red, green, blue, radius, intensity and classification
// count, under any of the names that programs use for them; all others are passed over.
Result<std::unique_ptr<PointReader>> open_ply_points(const InputFile& file, PlyHeader header);
// Lines of numbers (XYZ, PTS): x y z, and whichever of intensity, red, green, blue there are. columns: what they are; empty: the file tells.
Result<std::unique_ptr<PointReader>> open_text_points(const InputFile& file, const PointColumns& columns = {});

// Vertices, and no faces that would make a mesh of them.
bool is_point_ply(const PlyHeader& header);

}  // namespace raypager
