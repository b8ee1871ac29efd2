// Files that are whole or not there: written under a temporary name, verified, synced, renamed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace vdbfrac {

/// Writes `file` through a temporary in the same folder. `write` fills the temporary; `verify` (may be empty)
/// reads it back and throws when it is not what was meant. Then it is synced and renamed over `file`.
/// A symbolic link is followed: what it points to is written. Devices, pipes and folders are refused.
/// On any failure the temporary is removed, `file` is as it was, and a FileError names file and cause.
void writeAtomically(const std::filesystem::path& file,
                     const std::function<void(const std::filesystem::path& temporary)>& write,
                     const std::function<void(const std::filesystem::path& temporary)>& verify = {});

/// Makes a folder, with those above it, where there is none. Throws FileError.
void makeFolder(const std::filesystem::path& folder);
/// Removes a file if it is there. Throws FileError.
void removeFile(const std::filesystem::path& file);

/// Does a path, relative to a folder, name something below it? Lists in files of a run may say anything.
bool liesBelow(const std::filesystem::path& path);

/// Is it the name of such a temporary?
bool isTemporary(const std::filesystem::path& file);
/// Removes the temporaries that killed writers left in a folder, which need not exist.
void removeTemporaries(const std::filesystem::path& folder);

/// Writes text atomically; verifies the size and the bytes.
void writeText(const std::filesystem::path& file, std::string_view text);

/// Writes text at `offset` of a file that is made if need be, cuts off what was behind, and syncs it. What lies before
/// `offset` is as it was, whatever happens. Throws FileError.
void writeBehind(const std::filesystem::path& file, std::uint64_t offset, std::string_view text);

/// Whole content of a regular file of no more than `maxBytes`. Throws FileError, also when reading fails half way and
/// for devices, pipes and folders, which may have no end.
std::string readText(const std::filesystem::path& file, std::uint64_t maxBytes = ~std::uint64_t{0});
/// Throws FileError where readText would, but for errors of reading itself.
void requireRegular(const std::filesystem::path& file, std::uint64_t maxBytes = ~std::uint64_t{0});

}  // namespace vdbfrac
