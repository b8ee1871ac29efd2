#include <vdbfrac/core/archive.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>

#include <nlohmann/json.hpp>

#include <array>
#include <bit>
#include <cerrno>
#include <fstream>
#include <set>
#include <sstream>

namespace vdbfrac::core {

static_assert(std::endian::native == std::endian::little);

namespace {

using nlohmann::json;

constexpr std::string_view kMagic("vdbfrac\3", 8);
constexpr std::size_t kFixed = 24;  // bytes: magic, checksum, length of the directory

/// Bytes of a value; 0 for a type that does not exist.
std::size_t sizeOf(std::string_view type)
{
    const std::size_t width = type.starts_with('3') ? 3 : 1;
    if (width == 3) type.remove_prefix(1);
    for (const char* known : {"f8", "f4", "i8", "i4", "u8", "u4", "c1"})
        if (type == known) return width * std::size_t(known[1] - '0');
    return 0;
}

std::uint64_t numberAt(std::string_view bytes, std::size_t at)
{
    std::uint64_t n = 0;
    std::memcpy(&n, bytes.data() + at, sizeof n);
    return n;
}

}  // namespace

void Archive::complain(const std::string& what) const { throw FileError(source_, "is damaged: " + what); }

const Archive::Array& Archive::find(const std::string& name, std::string_view type) const
{
    for (const Array& array : arrays_)
        if (array.name == name) {
            if (array.type != type)
                complain("'" + name + "' is of type " + array.type + " instead of " + std::string(type));
            return array;
        }
    complain("it has no '" + name + "'");
}

std::string Archive::getText(const std::string& name) const
{
    const std::vector<char> text = get<char>(name);
    return std::string(text.begin(), text.end());
}

std::string Archive::directory() const
{
    json list = json::array();
    for (const Array& array : arrays_) list.push_back({array.name, array.type, array.values});
    return list.dump();
}

std::size_t Archive::byteCount() const
{
    std::size_t sum = 0;
    for (const Array& array : arrays_) sum += array.bytes.size();
    return sum;
}

std::uint64_t Archive::checksum() const
{
    const std::string head = directory();
    std::uint64_t sum = hashBytes(head.data(), head.size());
    for (const Array& array : arrays_) sum = hashBytes(array.bytes.data(), array.bytes.size(), sum);
    return sum;
}

void Archive::writeTo(std::ostream& out, std::uint64_t sum) const
{
    const std::string head = directory();
    const std::array<std::uint64_t, 2> numbers = {sum, head.size()};
    out.write(kMagic.data(), std::streamsize(kMagic.size()));
    out.write(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
    out.write(head.data(), std::streamsize(head.size()));
    for (const Array& array : arrays_)
        out.write(reinterpret_cast<const char*>(array.bytes.data()), std::streamsize(array.bytes.size()));
}

std::string Archive::bytes() const
{
    std::ostringstream out;
    writeTo(out, checksum());
    return std::move(out).str();
}

void Archive::write(const std::filesystem::path& file) const
{
    const std::uint64_t sum = checksum();
    const auto write = [&](const std::filesystem::path& temporary) {
        errno = 0;  // streams set it only where a call fails
        std::ofstream out(temporary, std::ios::binary);
        writeTo(out, sum);
        out.close();
        if (!out) throw Error(std::strerror(errno ? errno : EIO));
    };
    const auto verify = [&](const std::filesystem::path& temporary) {
        if (read(temporary).checksum() != sum) throw Error("what was read back differs from what was written");
    };
    writeAtomically(file, write, verify);
}

Archive Archive::read(const std::filesystem::path& file, std::uint64_t memoryLimit)
{
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (!error && size > memoryLimit)
        throw LimitError(file.string() + ": has " + std::to_string(size) + " bytes, the memory limit is " +
                         std::to_string(memoryLimit));
    return parse(readText(file), file.string());
}

Archive Archive::parse(std::string_view bytes, std::string source, bool checked)
{
    Archive archive;
    archive.source_ = std::move(source);
    if (bytes.size() < kFixed || !bytes.starts_with(kMagic))
        throw FileError(archive.source_, "is not a checkpoint of this version of vdbfrac");
    const std::uint64_t sum = numberAt(bytes, 8), length = numberAt(bytes, 16);
    bytes.remove_prefix(kFixed);
    if (length > bytes.size()) archive.complain("its directory is longer than the file");
    const json list = json::parse(bytes.substr(0, length), nullptr, false);
    bytes.remove_prefix(length);
    if (!list.is_array()) archive.complain("its directory cannot be read");
    std::set<std::string> names;
    for (const json& entry : list) {
        if (!(entry.is_array() && entry.size() == 3 && entry[0].is_string() && entry[1].is_string() &&
              entry[2].is_number_unsigned()))
            archive.complain("its directory has an entry that is not [name, type, values]");
        Array array{entry[0], entry[1], entry[2], {}};
        const std::size_t size = sizeOf(array.type);
        if (size == 0 || array.values > bytes.size() / size || !names.insert(array.name).second)
            archive.complain("array '" + array.name +
                             "' has an unknown type, occurs twice or extends past the end of the file");
        const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
        array.bytes.assign(first, first + array.values * size);
        bytes.remove_prefix(array.values * size);
        archive.arrays_.push_back(std::move(array));
    }
    if (!bytes.empty()) archive.complain("there are " + std::to_string(bytes.size()) + " bytes after its last array");
    if (checked && archive.checksum() != sum) archive.complain("its checksum does not match");
    return archive;
}

}  // namespace vdbfrac::core
