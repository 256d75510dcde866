// Which changes to kernel sources make another program of them.
#include <gtest/gtest.h>

#include <array>

#include "device/kernel_tokens.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {
namespace {

void expect_same(std::string_view a, std::string_view b) { EXPECT_EQ(kernel_tokens(a), kernel_tokens(b)) << a << "\n---\n" << b; }
void expect_other(std::string_view a, std::string_view b) { EXPECT_NE(kernel_tokens(a), kernel_tokens(b)) << a << "\n---\n" << b; }

TEST(KernelTokens, CommentsAndLayoutDoNotCount) {
    expect_same("uint a = b+c;", "// sum\nuint   a\n  = b /* here */ + c\n;  // there\n");
    expect_same("a = -b;", "a=-b;");
    expect_same("f(x)", "f (x)");
    expect_same("x = 1e-5f - y;", "x=1e-5f-y;");
    expect_same("a /* one // two \n three */ b", "a b");
    expect_same("a // one /* two\n b", "a b");
    expect_same("a;\r\nb;\r\n", "a;\nb;\n");
    expect_same("", " /* nothing */ \n // at all");
    expect_same("a /* without end", "a");
}

TEST(KernelTokens, TokensCount) {
    expect_other("a + b", "a - b");
    expect_other("ab", "a b");
    expect_other("a/**/b", "ab");
    expect_same("a/**/b", "a b");
    expect_other("1.0f", "1.5f");
    expect_other("a + +b", "a ++b");
    expect_other("a > > b", "a >> b");
    expect_other("x - 1e - 5", "x - 1e-5");
    expect_other("1 .5", "1.5");
}

TEST(KernelTokens, StringsStayAsTheyAre) {
    expect_other("asm(\"a  b\");", "asm(\"a b\");");
    expect_other("asm(\"a // b\");", "asm(\"a \");");
    expect_other("asm(\"/* a */\");", "asm(\"\");");
    expect_same("asm(\"say \\\" // \" /* but */);", "asm( \"say \\\" // \" );");
    expect_other("'/'", "'*'");
    expect_same("'\"' // \"\n a", "'\"' a");
}

TEST(KernelTokens, DirectivesKeepTheirLines) {
    expect_other("#define A\nB\n", "#define A B\n");
    expect_other("#if A\nb\n#endif\n", "#if A b\n#endif\n");
    expect_same("#define A  1 // one\nb", "  #  define A 1\n\n\nb\n");
    expect_same("x\n#if A\ny", "x // #else\n#if A /* more\nthan one line */\ny");
    expect_other("#define F(x) x", "#define F (x) x");
    expect_same("#define F(x) x", "#define F( x )   x");
    expect_same("#define F (x)", "#define F /* none */ (x)");
    expect_same("#undef A\n(b)", "#undef A\n( b )");
    expect_other("a # b", "a\n# b");
    expect_same("#error don't\n// that's it\na", "#error don't\na");
}

TEST(KernelTokens, LinesThatGoOnAreOne) {
    expect_same("#define A(x) \\\n    (x) + \\\n    1\nb", "#define A(x) (x) + 1\nb");
    expect_same("#define A 1 \\\r\n + 2\r\nb", "#define A 1 + 2\nb");
    expect_same("// a comment \\\n that goes on\nb", "b");
    expect_same("ab\\\ncd", "abcd");
    expect_other("#define A 1 \\\n b", "#define A 1\n b");
}

class KernelsIdentity : public testing::Test {
protected:
    uint64_t identity() const {
        const std::array<std::string_view, 2> stages = {"a/one", "a/two"};
        return kernels_identity(sources_, stages);
    }
    std::vector<KernelSource> sources_ = {{"a/one.cl", "#include \"b/a.cl\"\nkernel_one"},
                                          {"a/two.cl", "kernel_two"},
                                          {"a/probe.cl", "#include \"b/b.cl\"\nprobe"},
                                          {"b/a.cl", "// first\n#ifdef A\n#  include \"abi/c.h\" // for A\n#endif\na"},
                                          {"b/b.cl", "b"},
                                          {"abi/c.h", "#include \"b/a.cl\"\nc"}};
};

TEST_F(KernelsIdentity, IsThatOfWhatTheStagesInclude) {
    const uint64_t before = identity();
    sources_[2].text = "another probe";
    sources_[4].text = "another b";
    EXPECT_EQ(identity(), before) << "of tests alone";
    std::swap(sources_[0], sources_[5]);
    EXPECT_EQ(identity(), before) << "the order says nothing";
    sources_[0].text = "#include \"b/a.cl\"\nC";
    EXPECT_NE(identity(), before) << "included by what is included";
}

TEST_F(KernelsIdentity, IsThatOfTokens) {
    const uint64_t before = identity();
    sources_[3].text = "#ifdef A\n#include \"abi/c.h\"\n#endif\n\n  a  // last";
    EXPECT_EQ(identity(), before);
    sources_[3].text = "#ifdef A\n#include \"abi/c.h\"\n#endif\na a";
    EXPECT_NE(identity(), before);
}

// Every stage can change a picture, so all of them count.
TEST(KernelsIdentityOfRenders, KnowsAllStages) {
    const std::vector<KernelSource>& sources = kernel_sources();
    const uint64_t before = kernels_identity(sources, render_stages);
    size_t stages = 0;
    for (size_t i = 0; i < sources.size(); i++) {
        if (sources[i].text.find("__kernel void") == std::string_view::npos) continue;
        stages++;
        std::vector<KernelSource> changed = sources;
        const std::string text = std::string(sources[i].text) + "\nint another;\n", comment = std::string(sources[i].text) + "\n// another\n";
        changed[i].text = text;
        EXPECT_NE(kernels_identity(changed, render_stages), before) << sources[i].name;
        changed[i].text = comment;
        EXPECT_EQ(kernels_identity(changed, render_stages), before) << sources[i].name;
    }
    EXPECT_GT(stages, 8u);
}

}  // namespace
}  // namespace raypager
