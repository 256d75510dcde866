// Lines of text files: ends of every kind, byte order marks, and what is no text.
#include <gtest/gtest.h>

#include "import/line_reader.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;

class ImportLines : public testing::Test {
protected:
    // All lines, or what the error says after the name of the file.
    std::vector<std::string> lines(const std::string& content, uint64_t offset = 0) {
        const auto path = folder.write("a.txt", content);
        const auto file = InputFile::open(path);
        EXPECT_TRUE(file.ok());
        LineReader reader(*file, offset);
        std::vector<std::string> all;
        while (true) {
            std::string_view line;
            bool end = false;
            const uint64_t begin = reader.position();
            if (const Status status = reader.next(line, end); !status.ok()) {
                all.push_back(status.message().substr(path.string().size()));
                return all;
            }
            if (end) return all;
            EXPECT_EQ(reader.line(), all.size() + 1);
            if (!line.empty() && begin > 0) {
                EXPECT_EQ(content.substr(begin, line.size()), line);
            }
            all.emplace_back(line);
        }
    }
    using Lines = std::vector<std::string>;
    TemporaryFolder folder;
};

TEST_F(ImportLines, EveryKindOfEnd) {
    const Lines expected = {"one", "", "two", "three"};
    for (const char* last : {"", "\n"}) EXPECT_EQ(lines(std::string("one\n\ntwo\nthree") + last), expected);
    for (const char* last : {"", "\r\n"}) EXPECT_EQ(lines(std::string("one\r\n\r\ntwo\r\nthree") + last), expected);
    for (const char* last : {"", "\r"}) EXPECT_EQ(lines(std::string("one\r\rtwo\rthree") + last), expected);
    EXPECT_EQ(lines("one\r\r\n\r\r\ntwo\r\r\nthree"), expected) << "converted twice";
    EXPECT_EQ(lines("one\r\n\rtwo\nthree\r"), expected) << "each another one";
    EXPECT_EQ(lines(""), Lines());
    EXPECT_EQ(lines("\r"), Lines{""});
    EXPECT_EQ(lines("zero\rone\r\ntwo", 5), (Lines{"one", "two"}));
}

// Whatever falls on the borders between what is read at once.
TEST_F(ImportLines, EndsAtTheBordersOfTheBuffer) {
    for (const std::string end : {"\n", "\r\n", "\r", "\r\r\n"})
        for (size_t length = (size_t{64} << 10) - 4; length <= (size_t{64} << 10) + 1; ++length) {
            const std::string first(length, 'a'), second(length, 'b');
            EXPECT_EQ(lines(first + end + second + end + "c"), (Lines{first, second, "c"})) << length;
            EXPECT_EQ(lines(first + end), Lines{first}) << length;
            EXPECT_EQ(lines(first + "\n" + second + end + "c"), (Lines{first, second, "c"})) << length;
        }
}

TEST_F(ImportLines, ByteOrderMarks) {
    EXPECT_EQ(lines("\xef\xbb\xbf"
                    "1 2 3\n4"),
              (Lines{"1 2 3", "4"}));
    EXPECT_EQ(lines("\xef\xbb\xbf"), Lines());
    EXPECT_EQ(lines("1\n\xef\xbb\xbf"
                    "2"),
              (Lines{"1",
                     "\xef\xbb\xbf"
                     "2"}))
        << "only where the file begins";
    for (const std::string mark : {"\xff\xfe", "\xfe\xff"}) {
        const Lines refused = lines(mark + std::string("1\0\n\0", 4));
        ASSERT_EQ(refused.size(), 1u);
        EXPECT_EQ(refused[0].find(":1: is text in UTF-16"), 0u) << refused[0];
    }
}

TEST_F(ImportLines, ZeroBytesAreNoText) {
    const Lines found = lines("one\ntwo\nth" + std::string(1, '\0') + "ree\n");
    ASSERT_EQ(found.size(), 3u);
    EXPECT_EQ(found[2].find(":3: a zero byte"), 0u) << found[2];
}

}  // namespace
}  // namespace raypager
