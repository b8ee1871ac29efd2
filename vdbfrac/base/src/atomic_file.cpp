#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
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

}  // namespace

void writeAtomically(const fs::path& file, const std::function<void(const fs::path&)>& write,
                     const std::function<void(const fs::path&)>& verify)
{
    // The suffix stays last so that writers which choose a format by name see the right one.
    const fs::path temporary = file.parent_path() / (kTemporary + file.filename().string());
    try {
        write(temporary);
        if (verify) verify(temporary);
        syncPath(temporary, O_RDONLY);
        fs::rename(temporary, file);
        syncPath(file.has_parent_path() ? file.parent_path() : fs::path("."), O_RDONLY | O_DIRECTORY);
    } catch (const std::exception& e) {
        std::error_code ignored;
        fs::remove(temporary, ignored);
        throw FileError(file.string(), std::string("cannot be written: ") + e.what());
    }
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

std::string readText(const fs::path& file)
{
    if (fs::is_directory(file)) throw FileError(file.string(), "is a folder, not a file");
    std::ifstream in(file, std::ios::binary);
    if (!in) throw FileError(file.string(), std::strerror(errno));
    std::ostringstream text;
    text << in.rdbuf();
    if (in.bad()) throw FileError(file.string(), "cannot be read");
    return std::move(text).str();
}

}  // namespace vdbfrac
