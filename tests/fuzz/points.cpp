// Points as lines of numbers (XYZ, PTS), and PLY, OFF and OBJ files without faces. The first byte of an input says which, the rest is the file.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/cloud.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    const std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty float y\nproperty float z\nproperty uchar red\n"
        "property uchar green\nproperty uchar blue\nproperty float radius\nend_header\n";
    return {std::string(1, '\0') + "# points\n0 0 0\n1.5,2e3,-4\n1 1 1\n",
            "\1" + std::string("2\n0 0 0 -1200 10 20 30\n1 1 1 300 255 255 0\n"),
            std::string(1, '\0') + "\"Red\";Green;B;X [m];Y;Z\n1;2;250;1,5;2,5;3,5D2\n200;100;50;\"0,5\";1;2\n",
            std::string(1, '\0') + "\xef\xbb\xbf//X Y Z i rn label\r1 2 3 40 1 car\r4 5 6 50 2 a red car\r",
            "\1" + std::string("0 0 0 9 200 100 50\r\n1 1 1 90 100 50 20\r\n"),
            "\3" + std::string("COFF3 0 0\n0 0 0 255 0 0 1\n1 1 1 0 0 1\n# c\n\n1 0 0 9 9 9 9\n"),
            "\4" + std::string("v 0 0 0 1 0 0\rv 1 2 3 0 0 1\nvn 0 0 1\np 1\n"),
            "\2" + ply + "0 0 0 1 2 3 0.5\n1 1 1 255 255 255 0\n2 2 2 9 9 9 -1\n"};
}

void run(std::string_view input) {
    static const char* const endings[] = {".xyz", ".pts", ".ply", ".off", ".obj"};
    if (!input.empty()) load_cloud(endings[static_cast<uint8_t>(input[0]) % 5], input.substr(1));
}

}  // namespace raypager::fuzz
