#include <vdbfrac/base/hash.h>

#include <vdbfrac/base/error.h>

#include <fstream>
#include <vector>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace vdbfrac {

std::uint64_t hashBytes(const void* data, std::size_t bytes, std::uint64_t seed)
{
    return XXH3_64bits_withSeed(data, bytes, seed);
}

std::uint64_t hashFile(const std::filesystem::path& file, std::uint64_t seed)
{
    std::ifstream in(file, std::ios::binary);
    std::vector<char> piece(1 << 20);
    while (in.read(piece.data(), std::streamsize(piece.size())) || in.gcount() > 0)
        seed = hashBytes(piece.data(), std::size_t(in.gcount()), seed);
    if (!in.eof()) throw FileError(file.string(), "cannot be read");
    return seed;
}

std::string hexadecimal(std::uint64_t hash)
{
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string text(16, '0');
    for (int i = 15; i >= 0; --i, hash >>= 4) text[std::size_t(i)] = kDigits[hash & 15];
    return text;
}

}  // namespace vdbfrac
