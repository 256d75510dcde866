// Mesh files for tests.
#pragma once

#include <cstring>
#include <string>

#include "raypager/scene.hpp"

namespace raypager::test {

// A value's bytes, in either order.
template <class T>
std::string bytes_of(T value, bool big_endian = false) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

// A closed box from (0, 0, 0) to (x, y, z): 8 vertices, 12 triangles, oriented outwards.
inline TriangleMesh make_box(float x = 1, float y = 2, float z = 3) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) mesh.positions.push_back({i & 1 ? x : 0, i & 2 ? y : 0, i & 4 ? z : 0});
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

inline std::string to_ply_binary(const TriangleMesh& mesh, bool big_endian = false) {
    std::string text = std::string("ply\nformat ") + (big_endian ? "binary_big_endian" : "binary_little_endian") + " 1.0\ncomment a test\n";
    text += "element vertex " + std::to_string(mesh.positions.size()) + "\nproperty float x\nproperty float y\nproperty float z\n";
    text += "element face " + std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const Float3& p : mesh.positions)
        for (const float c : {p.x, p.y, p.z}) text += bytes_of(c, big_endian);
    for (const Triangle& t : mesh.triangles) {
        text += '\3';
        for (const uint32_t i : t) text += bytes_of(i, big_endian);
    }
    return text;
}

inline std::string to_text(const Float3& p) {
    char buffer[100];
    std::snprintf(buffer, sizeof buffer, "%.9g %.9g %.9g", double{p.x}, double{p.y}, double{p.z});
    return buffer;
}

inline std::string to_ply_text(const TriangleMesh& mesh) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(mesh.positions.size());
    text += "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(mesh.triangles.size());
    text += "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const Float3& p : mesh.positions) text += to_text(p) + "\n";
    for (const Triangle& t : mesh.triangles) text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
    return text;
}

inline std::string to_obj(const TriangleMesh& mesh) {
    std::string text = "# a test\n";
    for (const Float3& p : mesh.positions) text += "v " + to_text(p) + "\n";
    for (const Triangle& t : mesh.triangles)
        text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
    return text;
}

inline std::string to_off(const TriangleMesh& mesh) {
    std::string text = "OFF\n" + std::to_string(mesh.positions.size()) + " " + std::to_string(mesh.triangles.size()) + " 0\n";
    for (const Float3& p : mesh.positions) text += to_text(p) + "\n";
    for (const Triangle& t : mesh.triangles) text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
    return text;
}

inline std::string to_stl_text(const TriangleMesh& mesh) {
    std::string text = "solid test\n";
    for (const Triangle& t : mesh.triangles) {
        text += " facet normal 0 0 0\n  outer loop\n";
        for (const uint32_t i : t) text += "   vertex " + to_text(mesh.positions[i]) + "\n";
        text += "  endloop\n endfacet\n";
    }
    return text + "endsolid test\n";
}

inline std::string to_stl_binary(const TriangleMesh& mesh) {
    std::string text(80, ' ');
    text += bytes_of(static_cast<uint32_t>(mesh.triangles.size()));
    for (const Triangle& t : mesh.triangles) {
        text += std::string(12, '\0');
        for (const uint32_t i : t)
            for (const float c : {mesh.positions[i].x, mesh.positions[i].y, mesh.positions[i].z}) text += bytes_of(c);
        text += std::string(2, '\0');
    }
    return text;
}

}  // namespace raypager::test
