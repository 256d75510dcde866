// Damaged pictures end in one clear line that names the file; never in a crash, nor in memory out of proportion.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <random>

#include "base/files.hpp"
#include "raypager/picture.hpp"
#include "support/sanitizers.hpp"
#include "support/temporary_folder.hpp"

#if RAYPAGER_ADDRESS_SANITIZER
#include <sanitizer/lsan_interface.h>
#endif

namespace raypager {
namespace {

#if RAYPAGER_ADDRESS_SANITIZER
// OpenImageIO 2.4 loses a string when libpng jumps out of its read callback at the end of a truncated file.
using LibraryLeaksIgnored = __lsan::ScopedDisabler;
#else
struct LibraryLeaksIgnored {
    ~LibraryLeaksIgnored() {}
};
#endif

// Not through OutputFile, which waits for the disk: there are many.
void put(const std::filesystem::path& path, std::string_view text) {
    std::ofstream(path, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

std::vector<std::string> endings() {
#ifdef RAYPAGER_OPENIMAGEIO
    return {".pfm", ".exr", ".png"};
#else
    return {".pfm"};
#endif
}

class DamagedImages : public ::testing::Test {
protected:
#ifdef RAYPAGER_OPENIMAGEIO
    static void SetUpTestSuite() { use_openimageio(); }
#endif
};

Image sample_image() {
    std::mt19937 random(3);
    Image image{41, 29, 3, {}};
    for (int i = 0; i < 41 * 29 * 3; i++) image.values.push_back(static_cast<float>(random() % 1000) / 999.0f);
    return image;
}

void expect_clear_error(const std::filesystem::path& path) {
    const auto image = read_image(path);
    ASSERT_FALSE(image.ok()) << path;
    const std::string& message = image.status().message();
    EXPECT_NE(message.find(path.filename().string()), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST_F(DamagedImages, AbsentEmptyAndFolders) {
    const support::TemporaryFolder folder;
    for (const std::string& ending : endings()) {
        expect_clear_error(folder / ("absent" + ending));
        put(folder / ("empty" + ending), "");
        expect_clear_error(folder / ("empty" + ending));
        std::filesystem::create_directory(folder / ("folder" + ending));
        expect_clear_error(folder / ("folder" + ending));
        put(folder / ("text" + ending), "This is not a picture but a line of text.\n");
        expect_clear_error(folder / ("text" + ending));
    }
}

TEST_F(DamagedImages, Truncated) {
    const LibraryLeaksIgnored scope;
    const support::TemporaryFolder folder;
    for (const std::string& ending : endings()) {
        ASSERT_TRUE(write_image(folder / ("whole" + ending), sample_image()).ok());
        const std::string whole = *read_text(folder / ("whole" + ending));
        // A PNG's last 12 bytes are its end mark: decoders need not look at it.
        const size_t longest = whole.size() - (ending == ".png" ? 13 : 1);
        for (size_t i = 0; i <= 40; i++) {
            const size_t length = longest * i / 40;
            put(folder / ("cut" + ending), std::string_view(whole).substr(0, length));
            expect_clear_error(folder / ("cut" + ending));
        }
    }
}

// A flipped bit may go unnoticed where a format has no checksum, but then there is a picture of sane size.
TEST_F(DamagedImages, BitFlips) {
    const LibraryLeaksIgnored scope;
    const support::TemporaryFolder folder;
    const uint32_t seed = 99;
    std::mt19937 random(seed);
    for (const std::string& ending : endings()) {
        ASSERT_TRUE(write_image(folder / ("whole" + ending), sample_image()).ok());
        const std::string whole = *read_text(folder / ("whole" + ending));
        for (int i = 0; i < 300; i++) {
            std::string damaged = whole;
            const size_t range = i % 2 == 0 ? std::min<size_t>(whole.size(), 400) : whole.size();  // headers more often
            damaged[random() % range] ^= static_cast<char>(1u << random() % 8);
            put(folder / ("flipped" + ending), damaged);
            const auto image = read_image(folder / ("flipped" + ending));
            if (image.ok())
                EXPECT_EQ(image->values.size(), size_t{image->width} * image->height * image->channels) << ending << " " << i << ", seed " << seed;
            else
                EXPECT_FALSE(image.status().message().empty());
        }
    }
}

TEST_F(DamagedImages, HugeHeadersAllocateNothing) {
    const support::TemporaryFolder folder;
    struct rusage before {
    }, after{};
    getrusage(RUSAGE_SELF, &before);
    for (const char* text : {"PF\n60000 60000\n-1\n....", "PF\n16000 16000\n-1\n....", "Pf\n18446744073709551615 18446744073709551615\n-1\n",
                             "Pf\n99999999999999999999999 1\n-1\n", "Pf\n-5 5\n-1\n", "Pf\n0 5\n-1\n", "Pf\n5 5\n0\n", "Pf\n5 5\nnan\n", "Pf\n5"}) {
        put(folder / "huge.pfm", text);
        expect_clear_error(folder / "huge.pfm");
    }
    getrusage(RUSAGE_SELF, &after);
    EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 64 * 1024) << "KiB more than before";
}

#ifdef RAYPAGER_OPENIMAGEIO
void expect_refused(const std::filesystem::path& path, const std::string& words) {
    const auto image = read_image(path);
    ASSERT_FALSE(image.ok()) << path;
    EXPECT_NE(image.status().message().find(words), std::string::npos) << image.status().message();
}

TEST_F(DamagedImages, AHugePngIsRefusedBySize) {
    const support::TemporaryFolder folder;
    Image image = sample_image();
    ASSERT_TRUE(write_image(folder / "whole.png", image).ok());
    std::string damaged = *read_text(folder / "whole.png");
    // Width and height in the IHDR chunk: 2^31 - 1 each.
    for (const size_t at : {16u, 20u}) damaged.replace(at, 4, "\x7f\xff\xff\xff");
    put(folder / "huge.png", damaged);
    expect_clear_error(folder / "huge.png");
}

// The library would take the memory first.
TEST_F(DamagedImages, AnExrAttributeLargerThanItsFileIsRefused) {
    const support::TemporaryFolder folder;
    ASSERT_TRUE(write_image(folder / "whole.exr", sample_image()).ok());
    const std::string whole = *read_text(folder / "whole.exr");
    const std::string name_and_type("compression\0compression\0", 24);
    const size_t at = whole.find(name_and_type);
    ASSERT_NE(at, std::string::npos);
    for (const char* size : {"\xff\xff\xff\x7f", "\xff\xff\xff\xff"}) {
        std::string damaged = whole;
        damaged.replace(at + name_and_type.size(), 4, size);
        put(folder / "huge.exr", damaged);
        expect_refused(folder / "huge.exr", std::to_string(at + name_and_type.size() + 4));
    }
    // Cut right behind the size.
    put(folder / "cut.exr", std::string_view(whole).substr(0, at + name_and_type.size() + 4));
    expect_clear_error(folder / "cut.exr");
}

TEST_F(DamagedImages, APngChunkLargerThanItsFileIsRefused) {
    const support::TemporaryFolder folder;
    ASSERT_TRUE(write_image(folder / "whole.png", sample_image()).ok());
    const std::string whole = *read_text(folder / "whole.png");
    ASSERT_TRUE(read_image(folder / "whole.png").ok());
    // A text of a gigabyte behind the header's chunk.
    put(folder / "huge.png", whole.substr(0, 33) + std::string("\x40\0\0\0tEXt", 8) + whole.substr(33));
    expect_refused(folder / "huge.png", "1073741824 bytes at offset 41");
}

// A few bytes of deflated data as one row of 458,757 pixels: the library fills up what is missing.
TEST_F(DamagedImages, AnExrWiderThanItsBytesIsRefused) {
    const support::TemporaryFolder folder;
    ASSERT_TRUE(write_image(folder / "whole.exr", sample_image()).ok());
    std::string damaged = *read_text(folder / "whole.exr");
    const std::string name_and_type("dataWindow\0box2i\0", 17);
    const size_t at = damaged.find(name_and_type);
    ASSERT_NE(at, std::string::npos);
    damaged[at + name_and_type.size() + 4 + 10] = '\x07';  // of the last column, whose upper half is 0
    put(folder / "wide.exr", damaged);
    expect_refused(folder / "wide.exr", "can hold");
}

// Files are offered to the reader of their ending, not to all that there are.
TEST_F(DamagedImages, OneFormatUnderTheEndingOfAnotherIsRefused) {
    const support::TemporaryFolder folder;
    ASSERT_TRUE(write_image(folder / "whole.png", sample_image()).ok());
    ASSERT_TRUE(write_image(folder / "whole.exr", sample_image()).ok());
    std::filesystem::copy_file(folder / "whole.png", folder / "png.exr");
    std::filesystem::copy_file(folder / "whole.exr", folder / "exr.png");
    expect_clear_error(folder / "png.exr");
    expect_clear_error(folder / "exr.png");
    put(folder / "picture.nothing", "?");
    expect_clear_error(folder / "picture.nothing");
}
#endif

}  // namespace
}  // namespace raypager
