#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

namespace vdbfrac {

namespace fs = std::filesystem;

namespace {

constexpr const char* kTemporary = ".partial-";  // begins the names of temporaries

void syncPath(const fs::path& path, int flags)
{
    const int fd = ::open(path.c_str(), flags);
    if (fd < 0) throw FileError(path.string(), std::strerror(errno));
    const int failed = ::fsync(fd);
    const int cause = errno;
    ::close(fd);
    if (failed && cause != EINVAL) throw FileError(path.string(), std::strerror(cause));  // EINVAL: cannot be synced
}

/// What a path leads to that is no regular file, in words; empty for a regular one.
std::string otherKind(mode_t mode)
{
    return S_ISREG(mode)                    ? ""
           : S_ISDIR(mode)                  ? "is a folder, not a file"
           : S_ISFIFO(mode)                 ? "is a pipe, not a regular file"
           : S_ISCHR(mode) || S_ISBLK(mode) ? "is a device, not a regular file"
                                            : "is not a regular file";
}

constexpr std::size_t kPiece = 1 << 16;  // bytes

/// A regular file that is open for reading.
class Input {
public:
    // O_NONBLOCK: a pipe would block.
    Input(const fs::path& file, std::uint64_t maxBytes)
        : name_(file.string()),
          maxBytes_(maxBytes),
          descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK))
    {
        if (descriptor_ < 0) throw FileError(name_, std::strerror(errno));
        struct stat about {};
        std::string flaw = ::fstat(descriptor_, &about) == 0 ? otherKind(about.st_mode) : std::strerror(errno);
        bytes_ = std::uint64_t(about.st_size);
        if (flaw.empty() && bytes_ > maxBytes_) flaw = tooLarge(bytes_);
        if (flaw.empty()) return;
        ::close(descriptor_);
        throw FileError(name_, flaw);
    }
    ~Input() { ::close(descriptor_); }
    Input(const Input&) = delete;
    Input& operator=(const Input&) = delete;

    std::uint64_t bytes() const { return bytes_; }
    /// How many bytes it has read, 0 at the end.
    std::size_t read(char* to, std::size_t most) const
    {
        ssize_t got = 0;
        while ((got = ::read(descriptor_, to, most)) < 0)
            if (errno != EINTR) throw FileError(name_, std::string("cannot be read: ") + std::strerror(errno));
        return std::size_t(got);
    }
    void requireSize(std::uint64_t bytes) const
    {
        if (bytes > maxBytes_) throw FileError(name_, tooLarge(bytes));
    }

private:
    std::string tooLarge(std::uint64_t bytes) const
    {
        return "has " + std::to_string(bytes) + " bytes or more, at most " + std::to_string(maxBytes_) + " are read";
    }

    std::string name_;
    std::uint64_t maxBytes_, bytes_ = 0;
    int descriptor_;
};

/// Where a file with this name is written: at the end of its links, as the shell and cp do.
fs::path writtenTo(fs::path file)
{
    constexpr int kMaxLinks = 40;  // as the kernel has it
    for (int links = 0; fs::is_symlink(fs::symlink_status(file)); ++links) {
        if (links == kMaxLinks) throw Error(std::strerror(ELOOP));
        file = file.parent_path() / fs::read_symlink(file);  // an absolute one replaces the folder
    }
    return file;
}

void requireReplaceable(const fs::path& file)
{
    struct stat about {};
    if (::stat(file.c_str(), &about) != 0) return;  // nothing there; or the writer will say what is wrong
    if (const std::string flaw = otherKind(about.st_mode); !flaw.empty()) throw Error(flaw);
}

/// Its own for each writer: two that write one file at once do not write into each other's. The suffix stays last so
/// that writers which choose a format by name see the right one.
fs::path temporaryFor(const fs::path& target)
{
    static std::atomic<unsigned> writers = 0;
    const std::string writer = std::to_string(::getpid()) + "-" + std::to_string(writers++);
    return target.parent_path() / (kTemporary + writer + "-" + target.filename().string());
}

}  // namespace

void writeAtomically(const fs::path& file, const std::function<void(const fs::path&)>& write,
                     const std::function<void(const fs::path&)>& verify)
{
    fs::path temporary;
    try {
        const fs::path target = writtenTo(file);
        requireReplaceable(target);
        temporary = temporaryFor(target);
        write(temporary);
        if (verify) verify(temporary);
        syncPath(temporary, O_RDONLY);
        fs::rename(temporary, target);
        syncPath(target.has_parent_path() ? target.parent_path() : fs::path("."), O_RDONLY | O_DIRECTORY);
    } catch (const std::exception& e) {
        std::error_code ignored;
        if (!temporary.empty()) fs::remove(temporary, ignored);
        throw FileError(file.string(), std::string("cannot be written: ") + e.what());
    }
}

void makeFolder(const std::filesystem::path& folder)
{
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw FileError(folder.string(), "cannot be made: " + error.message());
}

void removeFile(const std::filesystem::path& file)
{
    std::error_code error;
    if (std::filesystem::remove(file, error); error)
        throw FileError(file.string(), "cannot be removed: " + error.message());
}

bool liesBelow(const fs::path& path)
{
    return !path.empty() && path.is_relative() &&
           std::none_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

bool isTemporary(const fs::path& file) { return file.filename().string().starts_with(kTemporary); }

void removeTemporaries(const fs::path& folder)
{
    std::error_code error;
    std::vector<fs::path> left;
    for (const auto& entry : fs::directory_iterator(folder, error))
        if (isTemporary(entry.path())) left.push_back(entry.path());
    for (const fs::path& file : left) fs::remove(file, error);
}

void writeText(const fs::path& file, std::string_view text)
{
    const auto write = [&](const fs::path& temporary) {
        errno = 0;  // streams set it only where a call fails
        std::ofstream out(temporary, std::ios::binary);
        out.write(text.data(), std::streamsize(text.size()));
        out.close();
        if (!out) throw Error(std::strerror(errno ? errno : EIO));
    };
    const auto verify = [&](const fs::path& temporary) {
        if (readText(temporary) != text) throw Error("what was read back differs from what was written");
    };
    writeAtomically(file, write, verify);
}

void writeBehind(const fs::path& file, std::uint64_t offset, std::string_view text)
{
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    bool failed = fd < 0 || ::ftruncate(fd, off_t(offset)) != 0;
    for (std::size_t done = 0; !failed && done < text.size();) {
        const ssize_t wrote = ::pwrite(fd, text.data() + done, text.size() - done, off_t(offset + done));
        if (wrote >= 0)
            done += std::size_t(wrote);
        else
            failed = errno != EINTR;
    }
    failed = failed || (::fsync(fd) != 0 && errno != EINVAL);
    const int cause = errno;
    if (fd >= 0 && ::close(fd) != 0 && !failed)
        throw FileError(file.string(), std::string("cannot be written: ") + std::strerror(errno));
    if (failed) throw FileError(file.string(), std::string("cannot be written: ") + std::strerror(cause));
}

std::string readText(const fs::path& file, std::uint64_t maxBytes)
{
    const Input in(file, maxBytes);
    std::string text(in.bytes(), '\0');
    std::size_t length = 0;
    for (;;) {  // files of /proc say that they have no bytes: the end is where nothing more is read
        if (length == text.size()) text.resize(length + kPiece);
        const std::size_t more = in.read(text.data() + length, text.size() - length);
        if (more == 0) break;
        length += more;
        in.requireSize(length);
    }
    text.resize(length);
    return text;
}

void requireRegular(const fs::path& file, std::uint64_t maxBytes) { (void)Input(file, maxBytes); }

}  // namespace vdbfrac
