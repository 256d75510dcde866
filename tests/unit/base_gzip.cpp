// Packed files read as what was packed, and say what is wrong with them.
#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <thread>

#include "base/files.hpp"
#include "raypager/import.hpp"
#include "support/failing_file_system.hpp"
#include "support/gzip.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::gzip_of;

class BaseGzip : public testing::Test {
protected:
    void TearDown() override { forget_unpacked_files(); }
    void expect_content(const std::string& name, const std::string& packed, const std::string& content) {
        const auto text = read_text(folder_.write(name, packed));
        ASSERT_TRUE(text.ok()) << text.status().message();
        EXPECT_EQ(*text, content);
    }
    void expect_error(const std::string& packed, const std::string& what) {
        const auto file = InputFile::open(folder_.write("bad.gz", packed));
        ASSERT_FALSE(file.ok()) << "expected " << what;
        EXPECT_EQ(file.status().message().find((folder_ / "bad.gz").string() + ": "), 0u) << file.status().message();
        EXPECT_NE(file.status().message().find(what), std::string::npos) << file.status().message();
        EXPECT_EQ(file.status().message().find('\n'), std::string::npos);
    }
    support::TemporaryFolder folder_;
    support::FailingFileSystem disk_;
};

TEST_F(BaseGzip, ReadsAsWhatWasPacked) {
    std::string large(3'000'000, '\0');
    for (size_t i = 0; i < large.size(); ++i) large[i] = static_cast<char>(i * i >> 7);
    expect_content("a.gz", gzip_of("one two"), "one two");
    expect_content("plain", gzip_of("under any name"), "under any name");
    expect_content("large.gz", gzip_of(large), large);
    expect_content("empty.gz", gzip_of(""), "");
    expect_content("no.gz", "not packed", "not packed");
    expect_content("short.gz", "\x1f\x8b", "\x1f\x8b");
    // By gzip itself.
    const std::string made("\x1f\x8b\x08\0\0\0\0\0\0\x03\x4b\x4c\xc4\x0b\x92\0\xcd\x46\xb8\x53\x20\0\0\0", 24);
    expect_content("made.gz", made, std::string(31, 'a') + "b");
    const auto file = InputFile::open(folder_.write("part.gz", gzip_of(large)));
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file->size(), large.size());
    std::byte bytes[5];
    ASSERT_TRUE(file->read(2'000'000, bytes).ok());
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes), 5), large.substr(2'000'000, 5));
    const Status beyond = file->read(large.size() - 4, bytes);
    EXPECT_NE(beyond.message().find("truncated"), std::string::npos) << beyond.message();
}

TEST_F(BaseGzip, MembersOneAfterAnotherAreOne) {
    expect_content("two.gz", gzip_of("one ") + gzip_of("two"), "one two");
    expect_content("padded.gz", gzip_of("one ") + std::string(512, '\0') + gzip_of("two") + std::string(100, '\0'), "one two");
    expect_content("tail.gz", gzip_of("one") + "something else", "one");
}

TEST_F(BaseGzip, DamageIsSaidNotRead) {
    const std::string sound = gzip_of(std::string(1000, 'x'));
    for (const size_t size : {size_t{3}, size_t{10}, size_t{500}, sound.size() - 1}) expect_error(sound.substr(0, size), "truncated");
    for (const size_t at : {size_t{14}, size_t{500}, sound.size() - 8, sound.size() - 1}) {
        std::string damaged = sound;
        damaged[at] = static_cast<char>(damaged[at] ^ 4);
        expect_error(damaged, "damaged at or before byte");
    }
    expect_error(gzip_of("one") + sound.substr(0, 300), "truncated");
}

TEST_F(BaseGzip, AFullDiskNamesTheFileAndTheWayOut) {
    const std::string sound = gzip_of("content");
    disk_.error_number = ENOSPC;
    disk_.fail_write_in = 1;
    const auto path = folder_.write("bad.gz", sound);
    const auto file = InputFile::open(path);
    ASSERT_FALSE(file.ok());
    const std::string& message = file.status().message();
    EXPECT_EQ(message.find(path.string()), 0u) << message;
    EXPECT_NE(message.find("No space left"), std::string::npos) << message;
    EXPECT_NE(message.find("TMPDIR"), std::string::npos) << message;
    disk_.clear();
    EXPECT_TRUE(InputFile::open(path).ok()) << "a failure is not kept";
}

TEST_F(BaseGzip, WhoseStartCannotBeReadIsNotTakenForUnpacked) {
    const auto path = folder_.write("a.gz", gzip_of("content"));
    disk_.fail_read_in = 1;  // comes up short
    const auto text = read_text(path);
    ASSERT_TRUE(text.ok()) << text.status().message();
    EXPECT_EQ(*text, "content");
    disk_.error_number = EIO;
    disk_.fail_read_in = 1;
    const auto file = InputFile::open(path);
    ASSERT_FALSE(file.ok());
    EXPECT_EQ(file.status().message(), path.string() + ": cannot be read: Input/output error");
}

TEST_F(BaseGzip, IsUnpackedOnceUntilItChanges) {
    const auto path = folder_.write("a.gz", gzip_of("first"));
    ASSERT_TRUE(InputFile::open(path).ok());
    disk_.error_number = EIO;
    disk_.fail_write_in = 1;
    EXPECT_TRUE(InputFile::open(path).ok()) << "unpacked again";
    disk_.clear();
    folder_.write("a.gz", gzip_of("second one"));
    const auto text = read_text(path);
    ASSERT_TRUE(text.ok());
    EXPECT_EQ(*text, "second one");
    const auto open = InputFile::open(path);
    forget_unpacked_files();
    std::byte bytes[10];
    EXPECT_TRUE(open->read(0, bytes).ok()) << "who has it open keeps it";
}

TEST_F(BaseGzip, ManyThreadsAndFiles) {
    for (int i = 0; i < 100; ++i) folder_.write(std::to_string(i) + ".gz", gzip_of(std::string(1000, static_cast<char>(i))));
    std::vector<std::thread> threads;
    std::atomic<int> right{0};
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            for (int i = 0; i < 100; ++i) {
                const auto text = read_text(folder_ / (std::to_string(i) + ".gz"));
                right += text.ok() && *text == std::string(1000, static_cast<char>(i));
            }
        });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(right, 400);
}

}  // namespace
}  // namespace raypager
