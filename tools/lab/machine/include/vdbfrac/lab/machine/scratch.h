// A folder for files that nobody keeps: written to see how long that takes, or to be refused.
#pragma once

#include <filesystem>

namespace vdbfrac::lab {

/// A new, empty folder among the temporary files ($TMPDIR), removed with all that is in it in the end. Throws
/// FileError.
class ScratchFolder {
public:
    ScratchFolder();
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace vdbfrac::lab
