// What OpenMesh gets to read. Its readers trust what they parse: a vertex that does not parse is left out and moves all later ones,
// a huge count is looped over, "mtllib" opens any file. So they are never shown the file itself, but a checked copy of it, made on
// the fly: only vertices, normals and faces, each line verified, errors found here with their line numbers.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <streambuf>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.hpp"
#include "import/line_reader.hpp"
#include "import/mesh_readers.hpp"
#include "import/ply_header.hpp"

namespace raypager {

// Stands for a coordinate that is not finite, which the text of a C++ stream cannot express; the importer turns it into infinity.
inline constexpr float not_finite_coordinate = 3.402823466e+38f;

// A stream buffer whose content is produced piece by piece. An error ends it: underflow() throws InputError (which the stream passes
// on if its exception mask holds badbit), and status() says why.
class CheckedInput : public std::streambuf {
public:
    struct InputError {};
    explicit CheckedInput(const InputFile& file) : file_(file) {}
    const Status& status() const { return error_; }
    // Faces that were handed on so far; a reader that passes on fewer has dropped some.
    uint64_t faces() const { return faces_; }

protected:
    // Appends some more content to out, nothing at the end.
    virtual Status produce(std::string& out) = 0;
    virtual void rewind() { faces_ = 0; }
    int_type underflow() final;
    // Only "where am I" (unknown) and "back to the start", which the OBJ reader asks for before its second pass.
    pos_type seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode mode) final;
    pos_type seekpos(pos_type position, std::ios_base::openmode mode) final;

    const InputFile& file_;
    uint64_t faces_ = 0;

private:
    std::string content_;
    Status error_;
};

// Content made from the lines of a text file.
class CheckedText : public CheckedInput {
public:
    explicit CheckedText(const InputFile& file) : CheckedInput(file), reader_(std::in_place, file) {}

protected:
    // What is shown instead of line. The views live until the next call.
    virtual Status rewrite(std::string_view line, std::string& out) = 0;
    virtual Status finish() = 0;  // at the end of the file
    void rewind() override;
    Status produce(std::string& out) final;
    Status bad(const std::string& what) const { return reader_->bad(what); }
    // Appends " x y z" (or an error if they are not numbers); zeros for a normal that is not finite.
    Status append_position(const std::vector<std::string_view>& words, std::array<size_t, 3> at, std::string& out) const;
    Status append_normal(const std::vector<std::string_view>& words, std::array<size_t, 3> at, std::string& out) const;
    // Appends the numbers of vertices, a blank before each. What can be none, negative or too large, becomes one that does not exist.
    Status append_indices(std::span<const std::string_view> words, std::string& out) const;
    static bool parse_count(std::string_view word, uint64_t& value);
    std::vector<std::string_view> words_;  // scratch

private:
    std::optional<LineReader> reader_;  // always there; emplaced anew to start again
    bool finished_ = false;
};

std::unique_ptr<CheckedInput> check_obj_text(const InputFile& file);
std::unique_ptr<CheckedInput> check_off_text(const InputFile& file);
std::unique_ptr<CheckedInput> check_ply_text(const InputFile& file, const PlyHeader& header, const PlyLayout& layout);
std::unique_ptr<CheckedInput> check_stl_text(const InputFile& file);
std::unique_ptr<CheckedInput> check_stl_binary(const InputFile& file);

enum class StlKind { text, binary };
// Binary if the size is what the triangle count says, text if it starts with "solid"; anything else is an error.
Result<StlKind> find_stl_kind(const InputFile& file);

}  // namespace raypager
