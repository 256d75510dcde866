// Ptex files for tests, by the description of the format alone.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

namespace raypager::support {

enum class PtexEncoding : uint32_t { constant, zipped, differences, tiled };

struct PtexFace {
    uint8_t log_width = 0, log_height = 0;
    PtexEncoding encoding = PtexEncoding::zipped;
    bool is_constant = false;  // as the list of faces says
};

struct PtexSettings {
    uint32_t data_type = 0;  // 0: bytes, 1: 16 bits, 2: halves, 3: floats
    uint16_t channels = 3;
    int32_t alpha_channel = -1;
    uint32_t mesh_type = 1;
};

class PtexWriter {
public:
    // value: of a texel's channel, as the integer or float is stored, in its low bytes.
    using Value = std::function<uint32_t(uint32_t face, uint32_t x, uint32_t y, uint32_t channel)>;

    static std::string write(const PtexSettings& settings, const std::vector<PtexFace>& faces, const Value& value) {
        const PtexWriter writer(settings, value);
        std::string infos, constants, headers, data;
        for (uint32_t f = 0; f < faces.size(); f++) {
            const PtexFace& face = faces[f];
            infos += std::string{static_cast<char>(face.log_width), static_cast<char>(face.log_height), 0, static_cast<char>(face.is_constant)};
            for (int edge = 0; edge < 4; edge++) infos += words({0xffffffffu});
            for (uint32_t c = 0; c < settings.channels; c++) constants += writer.number(value(f, 0, 0, c));
            const std::string block = face.is_constant ? "" : writer.block(f, face, {0, 0});
            headers += words({static_cast<uint32_t>(block.size()) | static_cast<uint32_t>(face.encoding) << 30});
            data += block;
        }
        infos = zip(infos), constants = zip(constants), headers = zip(headers);
        const auto size = [](const std::string& s) { return static_cast<uint32_t>(s.size()); };
        const auto count = static_cast<uint32_t>(faces.size()), level_bytes = size(headers) + size(data);
        std::string file = "Ptex" + words({1, settings.mesh_type, settings.data_type, static_cast<uint32_t>(settings.alpha_channel),
                                           settings.channels | 1u << 16, count, 0, size(infos), size(constants), 16, 4, level_bytes, 0, 0, 0});
        return file + infos + constants + words({level_bytes, 0, size(headers), count}) + headers + data;
    }

private:
    PtexWriter(const PtexSettings& settings, const Value& value) : settings_(settings), value_(value) {}

    static std::string words(const std::vector<uint32_t>& values) { return {reinterpret_cast<const char*>(values.data()), 4 * values.size()}; }
    static std::string zip(const std::string& content) {
        uLongf size = compressBound(content.size());
        std::string packed(size, '\0');
        compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(content.data()), content.size());
        packed.resize(size);
        return packed;
    }
    std::string number(uint32_t value) const {
        constexpr size_t bytes[] = {1, 2, 2, 4};
        return {reinterpret_cast<const char*>(&value), bytes[settings_.data_type]};
    }

    // at: where the block, a face or a tile of one, begins on its face.
    std::string block(uint32_t f, const PtexFace& size, std::array<uint32_t, 2> at) const {
        const uint32_t width = 1u << size.log_width, height = 1u << size.log_height;
        std::string content;
        if (size.encoding == PtexEncoding::constant) {
            for (uint32_t c = 0; c < settings_.channels; c++) content += number(value_(f, at[0], at[1], c));
            return content;
        }
        if (size.encoding == PtexEncoding::tiled) return tiles(f, size);
        for (uint32_t c = 0; c < settings_.channels; c++)
            for (uint32_t y = 0; y < height; y++)
                for (uint32_t x = 0; x < width; x++) content += number(value_(f, at[0] + x, at[1] + y, c));
        if (size.encoding == PtexEncoding::differences && settings_.data_type == 0) subtract<uint8_t>(content);
        if (size.encoding == PtexEncoding::differences && settings_.data_type == 1) subtract<uint16_t>(content);
        return zip(content);
    }

    // Four by four, or as many as there are texels; every other one by differences.
    std::string tiles(uint32_t f, const PtexFace& size) const {
        PtexFace tile = {static_cast<uint8_t>(size.log_width - std::min<int>(2, size.log_width)),
                         static_cast<uint8_t>(size.log_height - std::min<int>(2, size.log_height))};
        std::string headers, data;
        uint32_t number = 0;
        for (uint32_t y = 0; y < 1u << size.log_height; y += 1u << tile.log_height)
            for (uint32_t x = 0; x < 1u << size.log_width; x += 1u << tile.log_width) {
                tile.encoding = number++ % 2 ? PtexEncoding::differences : PtexEncoding::zipped;
                const std::string one = block(f, tile, {x, y});
                headers += words({static_cast<uint32_t>(one.size()) | static_cast<uint32_t>(tile.encoding) << 30});
                data += one;
            }
        headers = zip(headers);
        return std::string{static_cast<char>(tile.log_width), static_cast<char>(tile.log_height)} + words({static_cast<uint32_t>(headers.size())}) +
               headers + data;
    }

    template <class T>
    static void subtract(std::string& content) {
        T before = 0;
        for (size_t at = 0; at < content.size(); at += sizeof(T)) {
            T value;
            std::memcpy(&value, &content[at], sizeof(T));
            const T difference = static_cast<T>(value - before);
            std::memcpy(&content[at], &difference, sizeof(T));
            before = value;
        }
    }

    const PtexSettings& settings_;
    const Value& value_;
};

}  // namespace raypager::support
