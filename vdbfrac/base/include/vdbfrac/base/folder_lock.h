// Keeps a folder for one writer.
#pragma once

#include <filesystem>
#include <utility>

namespace vdbfrac {

/// While it lives, no other lock of the same folder can be made, in this or another process. It goes with the process,
/// however that ends. File systems that know no locks keep nobody out.
class FolderLock {
public:
    FolderLock() = default;
    /// Throws FileError when there is another.
    explicit FolderLock(const std::filesystem::path& folder);
    FolderLock(FolderLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    FolderLock& operator=(FolderLock&& other) noexcept
    {
        std::swap(descriptor_, other.descriptor_);
        return *this;
    }
    ~FolderLock();

private:
    int descriptor_ = -1;
};

}  // namespace vdbfrac
