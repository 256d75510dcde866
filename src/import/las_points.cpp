#include "import/las_header.hpp"
#include "import/point_readers.hpp"

namespace raypager {
namespace {

// Where things are in a point of each format (LAS 1.4 R15, tables 7 to 17). X, Y, Z and intensity lie alike in all.
struct Layout {
    bool modern;  // formats 6 on: a byte of flags at 15 and the class at 16; before: class and flags share byte 15
    uint8_t rgb;  // offset, 0: none
};
constexpr Layout layouts[] = {{false, 0}, {false, 0}, {false, 20}, {false, 28}, {false, 0}, {false, 28},
                              {true, 0},  {true, 30}, {true, 30},  {true, 0},   {true, 30}};

constexpr uint8_t low_noise = 7, high_noise = 18;

class LasReader final : public RecordReader {
public:
    explicit LasReader(const LasHeader& header)
        : RecordReader({header.points_offset, header.count, header.record_bytes}), header_(header), layout_(layouts[header.format]) {}

    PointFields fields() const override {
        return {.color = layout_.rgb != 0,
                .intensity = true,
                .classification = true,
                .color_type = ColorType::word,
                .z_up = true,
                .geographic = header_.geographic};
    }

    std::vector<std::string> warnings() const override { return header_.warnings; }

    void decode(const std::byte* record, size_t count, std::vector<FilePoint>& points) const override {
        for (size_t i = 0; i < count; ++i, record += header_.record_bytes) {
            const auto flags = load_las<uint8_t>(record + 15);
            const bool withheld = layout_.modern ? (flags & 4) != 0 : (flags & 128) != 0;
            const uint8_t classification = layout_.modern ? load_las<uint8_t>(record + 16) : flags & 31;
            if (withheld || classification == low_noise || (layout_.modern && classification == high_noise)) continue;
            FilePoint& point = points.emplace_back();
            for (size_t a = 0; a < 3; ++a) point.position[a] = load_las<int32_t>(record + 4 * a) * header_.scale[a] + header_.offset[a];
            point.intensity = load_las<uint16_t>(record + 12);
            point.classification = classification;
            if (layout_.rgb == 0) continue;
            for (size_t c = 0; c < 3; ++c) point.color[c] = load_las<uint16_t>(record + layout_.rgb + 2 * c);
        }
    }

private:
    LasHeader header_;
    Layout layout_;
};

}  // namespace

Result<std::unique_ptr<PointReader>> open_las(const InputFile& file) {
    const auto header = read_las_header(file);
    if (!header) return header.status();
    return std::unique_ptr<PointReader>(std::make_unique<LasReader>(*header));
}

}  // namespace raypager
