// Fingerprints of data, for state hashes and file checksums.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace vdbfrac {

/// 64-bit XXH3 of raw bytes, chained through `seed`.
std::uint64_t hashBytes(const void* data, std::size_t bytes, std::uint64_t seed = 0);

/// Hash of the bytes of a contiguous range of trivially copyable values without padding.
template <class T>
std::uint64_t hashOf(std::span<const T> values, std::uint64_t seed = 0)
{
    return hashBytes(values.data(), values.size_bytes(), seed);
}

/// Of a file's bytes, read in pieces. Throws FileError.
std::uint64_t hashFile(const std::filesystem::path& file, std::uint64_t seed = 0);

/// 16 hexadecimal digits.
std::string hexadecimal(std::uint64_t hash);

}  // namespace vdbfrac
