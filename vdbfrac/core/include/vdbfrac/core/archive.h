// Named arrays of numbers, in memory and as a file: what a checkpoint is made of.
//
// The file, little-endian: "vdbfrac\3", the checksum (8 bytes), the length of the directory (8 bytes), the directory,
// the arrays one behind the other. The directory is JSON: [[name, type, values], ...] in the order of the arrays; types
// are "f8", "f4", "i8", "i4", "u8", "u4", "c1" as in NumPy, with "3" before them for vectors. The checksum is XXH3 of
// the directory and of each array, each seeded with the one before.
#pragma once

#include <vdbfrac/base/vec.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iosfwd>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::core {

template <class T>
inline constexpr const char* kTypeName = nullptr;
template <>
inline constexpr const char* kTypeName<double> = "f8";
template <>
inline constexpr const char* kTypeName<float> = "f4";
template <>
inline constexpr const char* kTypeName<std::int64_t> = "i8";
template <>
inline constexpr const char* kTypeName<std::int32_t> = "i4";
template <>
inline constexpr const char* kTypeName<std::uint64_t> = "u8";
template <>
inline constexpr const char* kTypeName<std::uint32_t> = "u4";
template <>
inline constexpr const char* kTypeName<char> = "c1";
template <>
inline constexpr const char* kTypeName<Vec3> = "3f8";
template <>
inline constexpr const char* kTypeName<Coord> = "3i4";
static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Coord) == 3 * sizeof(std::int32_t));

class Archive {
public:
    /// Copies an array; takes the place of one of that name.
    template <class T>
    void put(const std::string& name, std::span<const T> values)
    {
        std::erase_if(arrays_, [&](const Array& array) { return array.name == name; });
        const auto* first = reinterpret_cast<const std::byte*>(values.data());
        arrays_.push_back({name, kTypeName<T>, values.size(), {first, first + values.size_bytes()}});
    }
    template <class T>
    void put(const std::string& name, const std::vector<T>& values)
    {
        put(name, std::span<const T>(values));
    }
    template <class T>
    void putOne(const std::string& name, const T& value)
    {
        put(name, std::span<const T>(&value, 1));
    }
    void putText(const std::string& name, std::string_view text) { put(name, std::span<const char>(text)); }

    bool has(const std::string& name) const
    {
        return std::any_of(arrays_.begin(), arrays_.end(), [&](const Array& array) { return array.name == name; });
    }
    /// Throws FileError when there is no such array of this type.
    template <class T>
    std::vector<T> get(const std::string& name) const
    {
        const Array& array = find(name, kTypeName<T>);
        std::vector<T> values(array.values);
        if (!values.empty()) std::memcpy(static_cast<void*>(values.data()), array.bytes.data(), array.bytes.size());
        return values;
    }
    /// The same for an array of `count` values.
    template <class T>
    std::vector<T> get(const std::string& name, std::size_t count) const
    {
        std::vector<T> values = get<T>(name);
        if (values.size() != count)
            complain("'" + name + "' has " + std::to_string(values.size()) + " values instead of " +
                     std::to_string(count));
        return values;
    }
    template <class T>
    T getOne(const std::string& name) const
    {
        return get<T>(name, 1)[0];
    }
    std::string getText(const std::string& name) const;

    /// Throws FileError: what the file holds is not what was meant.
    [[noreturn]] void complain(const std::string& what) const;

    std::size_t byteCount() const;  ///< of all values
    /// Of names, types and values.
    std::uint64_t checksum() const;
    /// What write puts into a file.
    std::string bytes() const;
    /// Writes a file, whole or not at all. Throws FileError.
    void write(const std::filesystem::path& file) const;
    /// Throws FileError for what is damaged, LimitError for a file larger than `memoryLimit` bytes.
    static Archive read(const std::filesystem::path& file, std::uint64_t memoryLimit = ~std::uint64_t{0});
    /// The bytes of a file; `source` is its name in messages. A wrong checksum passes unless `checked`. Throws
    /// FileError.
    static Archive parse(std::string_view bytes, std::string source, bool checked = true);

private:
    struct Array {
        std::string name, type;
        std::size_t values = 0;
        std::vector<std::byte> bytes;
    };
    const Array& find(const std::string& name, std::string_view type) const;
    std::string directory() const;
    void writeTo(std::ostream& out, std::uint64_t sum) const;

    std::vector<Array> arrays_;
    std::string source_ = "checkpoint";
};

}  // namespace vdbfrac::core
