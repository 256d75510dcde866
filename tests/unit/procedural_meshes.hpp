// Reading back what the generators write, and asking whether it is closed.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "base/files.hpp"
#include "raypager/scene.hpp"

namespace raypager::procedural_test {

// A PLY file exactly of the kind that PlyWriter writes; nothing if anything is off.
inline std::optional<TriangleMesh> read_ply(const std::filesystem::path& path) {
    const auto text = read_text(path);
    if (!text.ok()) return std::nullopt;
    const std::string_view end = "end_header\n";
    const size_t header = text->find(end);
    if (header == std::string::npos || text->rfind("ply\nformat binary_little_endian 1.0\n", 0) != 0) return std::nullopt;
    size_t vertices = 0, faces = 0, vertex_bytes = 12, normal_bytes = 0;
    std::istringstream lines(text->substr(0, header));
    for (std::string line; std::getline(lines, line);) {
        if (line.rfind("element vertex ", 0) == 0) vertices = std::stoull(line.substr(15));
        if (line.rfind("element face ", 0) == 0) faces = std::stoull(line.substr(13));
        if (line == "property float u" || line == "property float v") vertex_bytes += 4;
        if (line.rfind("property float n", 0) == 0) vertex_bytes += 4, normal_bytes += 4;
    }
    const size_t at = header + end.size();
    if (text->size() != at + vertices * vertex_bytes + faces * 13) return std::nullopt;
    TriangleMesh mesh;
    mesh.positions.resize(vertices);
    mesh.triangles.resize(faces);
    if (vertex_bytes - normal_bytes == 20) mesh.uvs.resize(vertices);
    for (size_t i = 0; i < vertices; i++) {
        std::memcpy(&mesh.positions[i], text->data() + at + i * vertex_bytes, 12);
        if (!mesh.uvs.empty()) std::memcpy(&mesh.uvs[i], text->data() + at + i * vertex_bytes + 12 + normal_bytes, 8);
    }
    for (size_t i = 0; i < faces; i++) {
        const char* face = text->data() + at + vertices * vertex_bytes + i * 13;
        if (*face != 3) return std::nullopt;
        std::memcpy(mesh.triangles[i].data(), face + 1, 12);
        for (const uint32_t v : mesh.triangles[i])
            if (v >= vertices) return std::nullopt;
    }
    return mesh;
}

// One mesh of several, in which vertices at equal positions are one.
inline TriangleMesh merge_by_position(const std::vector<TriangleMesh>& meshes) {
    std::map<std::array<uint32_t, 3>, uint32_t> numbers;
    TriangleMesh merged;
    for (const TriangleMesh& mesh : meshes)
        for (const Triangle& triangle : mesh.triangles) {
            Triangle& t = merged.triangles.emplace_back();
            for (size_t k = 0; k < 3; k++) {
                const Float3& p = mesh.positions[triangle[k]];
                const std::array<uint32_t, 3> key = {std::bit_cast<uint32_t>(p.x), std::bit_cast<uint32_t>(p.y), std::bit_cast<uint32_t>(p.z)};
                const auto [entry, is_new] = numbers.try_emplace(key, static_cast<uint32_t>(merged.positions.size()));
                if (is_new) merged.positions.push_back(p);
                t[k] = entry->second;
            }
        }
    return merged;
}

struct EdgeCounts {
    size_t paired = 0;   // met once in each direction: two triangles that agree on what is outside
    size_t open = 0;     // of one triangle only
    size_t tangled = 0;  // everything else
};

inline EdgeCounts count_edges(const TriangleMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, std::array<int, 2>> edges;
    for (const Triangle& t : mesh.triangles)
        for (size_t k = 0; k < 3; k++) {
            const uint32_t a = t[k], b = t[(k + 1) % 3];
            edges[{std::min(a, b), std::max(a, b)}][a < b ? 0 : 1]++;
        }
    EdgeCounts counts;
    for (const auto& [edge, uses] : edges) {
        if (edge.first != edge.second && uses[0] == 1 && uses[1] == 1)
            counts.paired++;
        else if (edge.first != edge.second && uses[0] + uses[1] == 1)
            counts.open++;
        else
            counts.tangled++;
    }
    return counts;
}

// Positive if triangles are counter-clockwise seen from outside (divergence theorem).
inline double signed_volume(const TriangleMesh& mesh) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Float3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        sum += double{a.x} * (double{b.y} * c.z - double{b.z} * c.y) + double{a.y} * (double{b.z} * c.x - double{b.x} * c.z) +
               double{a.z} * (double{b.x} * c.y - double{b.y} * c.x);
    }
    return sum / 6;
}

// The lines of all files of instances, and how many files there are.
inline std::vector<std::string> instance_lines(const std::filesystem::path& folder, size_t* files = nullptr) {
    std::vector<std::string> lines;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "instances")) {
        std::istringstream text(*read_text(entry.path()));
        for (std::string line; std::getline(text, line);) lines.push_back(line);
        if (files) ++*files;
    }
    return lines;
}

struct InstanceLine {
    std::array<std::array<double, 3>, 4> columns;
    std::string object;
};

inline InstanceLine parse_instance(const std::string& line) {
    InstanceLine parsed;
    std::istringstream text(line.substr(line.find('[') + 1));
    for (auto& column : parsed.columns) {
        for (double& x : column) text >> x;
        int last = -1;
        text >> last;
        EXPECT_EQ(last, &column == &parsed.columns[3]) << line;
    }
    EXPECT_TRUE(text) << line;
    const size_t quote = line.find('"');
    parsed.object = line.substr(quote + 1, line.rfind('"') - quote - 1);
    return parsed;
}

}  // namespace raypager::procedural_test
