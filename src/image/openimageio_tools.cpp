#include "image/openimageio_tools.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <mutex>

#include "base/files.hpp"
#include "image/claimed_sizes.hpp"

namespace raypager {
namespace {

// Of all that are silent at once the first takes stderr away, and the last brings it back.
std::mutex silence;
int silent_users = 0, saved_stderr = -1;

}  // namespace

SilentStderr::SilentStderr() {
    const std::lock_guard lock(silence);
    if (silent_users++ > 0) return;
    saved_stderr = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (saved_stderr >= 0 && nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
    if (nowhere >= 0) ::close(nowhere);
}

SilentStderr::~SilentStderr() {
    const std::lock_guard lock(silence);
    if (--silent_users > 0 || saved_stderr < 0) return;
    ::dup2(saved_stderr, STDERR_FILENO);
    ::close(saved_stderr);
}

std::string one_line(std::string text) {
    std::ranges::replace(text, '\n', ' ');
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text.empty() ? "no reason given" : text;
}

// Deflate packs at most 1032 bytes into one (zlib Technical Details, zlib.net), and run lengths fewer: a file that claims more is damaged, which
// OpenEXR does not always notice. Of other ways of packing there is no such bound.
bool claims_too_much(const OIIO::ImageSpec& spec, const std::string& format, uint64_t file_bytes) {
    const std::string packing = spec.get_string_attribute("compression");
    const bool bounded = format == "png" || packing == "zip" || packing == "zips" || packing == "rle" || packing == "none";
    return bounded && spec.image_bytes(true) / 1032 > file_bytes;
}

Result<std::unique_ptr<OIIO::ImageInput>> open_image_input(const std::filesystem::path& path, const OIIO::ImageSpec& config) {
    // Absent, unreadable and irregular files are told apart by us: the library's words for them vary with the format.
    auto file = InputFile::open(path);
    if (!file) return file.status();
    RAYPAGER_TRY(check_exr_attributes(bytes_of_file(*file)));
    RAYPAGER_TRY(check_png_chunks(bytes_of_file(*file)));
    const SilentStderr silent;
    // The reader of this ending. Asked with the file's name instead, the library offers a file that this reader refuses to all others.
    const std::string ending = lower_case_ending(path);
    std::unique_ptr<OIIO::ImageInput> input = ending.size() > 1 ? OIIO::ImageInput::create(ending.substr(1)) : nullptr;
    if (!input) return Status::failed(fmt::format("{}: no format of pictures has the ending \"{}\"", path.string(), ending));
    OIIO::ImageSpec ignored;
    if (!input->open(path.string(), ignored, config))
        return Status::failed(
            fmt::format("{}: is not a {} picture that can be read: {}", path.string(), input->format_name(), one_line(input->geterror())));
    return input;
}

Result<std::unique_ptr<OIIO::ImageInput>> open_image_input(const EmbeddedPicture& picture, OIIO::Filesystem::IOProxy& bytes,
                                                           const OIIO::ImageSpec& config) {
    RAYPAGER_TRY(check_exr_attributes(bytes_in_memory(picture.name, picture.bytes)));
    RAYPAGER_TRY(check_png_chunks(bytes_in_memory(picture.name, picture.bytes)));
    const SilentStderr silent;
    std::unique_ptr<OIIO::ImageInput> input = picture.ending.size() > 1 ? OIIO::ImageInput::create(picture.ending.substr(1)) : nullptr;
    if (!input || input->supports("ioproxy") == 0)
        return Status::failed(picture.name + ": is a picture of no kind that can be read inside of a file");
    OIIO::Filesystem::IOProxy* proxy = &bytes;
    OIIO::ImageSpec with_proxy = config, ignored;
    with_proxy.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    if (!input->open("picture" + picture.ending, ignored, with_proxy))
        return Status::failed(
            fmt::format("{}: is not a {} picture that can be read: {}", picture.name, input->format_name(), one_line(input->geterror())));
    return input;
}

}  // namespace raypager
