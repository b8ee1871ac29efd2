#include "vdb_stream.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace vdbfrac::grid {

namespace {

namespace io = openvdb::io;

constexpr std::uint64_t kMagic = 0x56444220;   // " BDV" and four zero bytes
constexpr std::uint32_t kOldestVersion = 222;  // masks are compressed since; older trees take other, unchecked ways
constexpr std::uint32_t kNewestVersion = openvdb::OPENVDB_FILE_VERSION;
constexpr std::int32_t kMaxGrids = 10000;
constexpr std::uint64_t kMaxMemory = std::uint64_t{1} << 48;  // bytes of a grid, whatever it says: sums stay in range
/// Bytes in memory for a byte of a file: a leaf of vec3d takes 12.4 kB, and in a file 128 bytes for its masks alone.
constexpr std::uint64_t kMaxPerByte = 200;
/// Trees that are read, with the bytes of a value. Not those of bool: the library takes any byte of a file for one.
struct KnownType {
    const char* name;
    std::uint64_t valueBytes;
};
constexpr std::array<KnownType, 7> kKnownTypes{{{"Tree_float_5_4_3", 4},
                                                {"Tree_double_5_4_3", 8},
                                                {"Tree_int32_5_4_3", 4},
                                                {"Tree_int64_5_4_3", 8},
                                                {"Tree_vec3s_5_4_3", 12},
                                                {"Tree_vec3d_5_4_3", 24},
                                                {"Tree_vec3i_5_4_3", 12}}};

/// Looks ahead in a stream, to see that what is declared there fits into the file; goBack() ends the look.
class LookAhead {
public:
    LookAhead(std::istream& in, std::uint64_t fileSize) : in_(in), start_(in.tellg()), size_(fileSize) {}
    void goBack() { in_.seekg(start_); }

    template <class T>
    T value()
    {
        T v{};
        in_.read(reinterpret_cast<char*>(&v), sizeof(T));
        return v;
    }
    std::string text()
    {
        const std::uint32_t length = value<std::uint32_t>();
        require(length <= size_ - std::uint64_t(in_.tellg()), "declares a name longer than itself");
        std::string s(length, '\0');
        in_.read(s.data(), length);
        return s;
    }
    /// Returns the bytes that a grid says it takes in memory, 0 when it does not say.
    std::uint64_t metadata()
    {
        const std::uint32_t count = value<std::uint32_t>();
        std::uint64_t memory = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::string key = text();
            const std::string bytes = entry(text());
            if (key == openvdb::GridBase::META_FILE_MEM_BYTES && bytes.size() == sizeof(memory))
                std::memcpy(&memory, bytes.data(), sizeof(memory));
        }
        return memory;
    }
    void transform()
    {
        const std::streampos start = in_.tellg();
        text();  // the name of its map
        in_.seekg(start);
        openvdb::math::Transform().read(in_);
    }
    /// The root of a tree: the library would believe its counts, and take any byte for the state of a tile.
    void root(std::uint64_t valueBytes)
    {
        constexpr std::uint64_t kOrigin = 3 * sizeof(std::int32_t);
        require(value<std::int32_t>() == 1, "has a tree of more than one buffer");
        in_.seekg(std::streamoff(valueBytes), std::ios::cur);  // the background
        const std::uint64_t tiles = value<std::uint32_t>(), children = value<std::uint32_t>();
        require(tiles * (kOrigin + valueBytes + 1) + children * kOrigin <= size_,
                "declares more tiles than it can hold");
        for (std::uint64_t t = 0; t < tiles; ++t) {
            in_.seekg(std::streamoff(kOrigin + valueBytes), std::ios::cur);
            require(value<std::uint8_t>() <= 1, "has a tile that is neither on nor off");
        }
    }
    void require(bool holds, const char* what)
    {
        if (!holds) throw openvdb::IoError(what);
    }

private:
    /// The declared length has to be what the library will read, or all that follows would be read shifted.
    std::string entry(const std::string& type)
    {
        std::string bytes = text();
        if (type == openvdb::BoolMetadata::staticTypeName())
            require(bytes.size() == 1 && static_cast<unsigned char>(bytes[0]) <= 1,
                    "has a truth that is neither true nor false");
        else if (type != openvdb::StringMetadata::staticTypeName() && openvdb::Metadata::isRegisteredType(type))
            require(bytes.size() == openvdb::Metadata::createMetadata(type)->size(), "has metadata of a wrong length");
        return bytes;
    }

    std::istream& in_;
    std::streampos start_;
    std::uint64_t size_;
};

/// What io::Stream does, with a look at every size before it is believed.
class CheckedArchive : public io::Archive {
public:
    CheckedArchive(std::string name, std::uint64_t memoryLimit) : name_(std::move(name)), memoryLimit_(memoryLimit) {}

    openvdb::GridPtrVec read(std::istream& in, std::uint64_t fileSize)
    {
        requireHeader(in, fileSize);
        readHeader(in);
        auto streamMetadata = openvdb::SharedPtr<io::StreamMetadata>(new io::StreamMetadata);
        io::setStreamMetadataPtr(in, streamMetadata, /*transfer=*/false);
        io::setVersion(in, libraryVersion(), fileVersion());
        io::setDataCompression(in, compression());
        lookAtMetadata(in, fileSize);
        openvdb::MetaMap metadata;
        metadata.readMeta(in);
        const std::int32_t count = readGridCount(in);
        if (count < 0 || count > kMaxGrids) throw openvdb::IoError("declares " + std::to_string(count) + " grids");
        for (std::int32_t i = 0; i < count; ++i) readNext(in, fileSize);
        return std::move(grids_);
    }

private:
    static void lookAtMetadata(std::istream& in, std::uint64_t fileSize)
    {
        LookAhead ahead(in, fileSize);
        ahead.metadata();
        ahead.goBack();
    }

    static void requireHeader(std::istream& in, std::uint64_t fileSize)
    {
        LookAhead ahead(in, fileSize);
        ahead.require(ahead.value<std::uint64_t>() == kMagic, "is not a .vdb file");
        const std::uint32_t version = ahead.value<std::uint32_t>();
        ahead.require(version >= kOldestVersion, "is of a version of .vdb that is too old");
        ahead.require(version <= kNewestVersion, "is of a version of .vdb that is too new");
        ahead.goBack();
    }

    void readNext(std::istream& in, std::uint64_t fileSize)
    {
        const KnownType* type = lookAtDescriptor(in, fileSize);
        if (!type) {
            skipUnknown(in);
            return;
        }
        io::GridDescriptor descriptor;
        openvdb::GridBase::Ptr grid = descriptor.read(in);
        lookAtGrid(in, fileSize, descriptor.isInstance() ? nullptr : type);
        readGrid(grid, descriptor, in);
        grid->removeMeta(openvdb::GridBase::META_FILE_DELAYED_LOAD);  // kept as raw bytes; see initializeOpenVdb
        byName_[descriptor.uniqueName()] = grid;
        if (descriptor.isInstance()) connectInstance(descriptor, byName_);
        grids_.push_back(grid);
        io::setDataCompression(in, compression());
    }

    /// The type of a grid; null when it is none that is read. Leaves the end of its data in end_.
    const KnownType* lookAtDescriptor(std::istream& in, std::uint64_t fileSize)
    {
        LookAhead ahead(in, fileSize);
        ahead.text();
        std::string type = ahead.text();
        if (type.ends_with("_HalfFloat")) type.resize(type.size() - std::strlen("_HalfFloat"));
        ahead.text();
        ahead.value<std::int64_t>();
        ahead.value<std::int64_t>();
        end_ = ahead.value<std::int64_t>();
        ahead.require(end_ <= std::int64_t(fileSize), "points beyond its end");
        ahead.goBack();
        const auto known =
            std::find_if(kKnownTypes.begin(), kKnownTypes.end(), [&](const KnownType& k) { return type == k.name; });
        return known == kKnownTypes.end() ? nullptr : &*known;
    }

    void skipUnknown(std::istream& in)
    {
        if (!inputHasGridOffsets() || end_ <= std::int64_t(in.tellg()))
            throw openvdb::IoError("holds a grid of a type that is not read and cannot be skipped");
        in.seekg(end_);
    }

    /// `type`: of its tree; null when it has none of its own.
    void lookAtGrid(std::istream& in, std::uint64_t fileSize, const KnownType* type)
    {
        LookAhead ahead(in, fileSize);
        ahead.value<std::uint32_t>();  // compression flags
        const std::uint64_t bytes = ahead.metadata();
        ahead.require(bytes / kMaxPerByte <= fileSize, "declares a grid larger than it can hold");
        requireMemory(bytes);
        ahead.transform();
        if (type) ahead.root(type->valueBytes);
        ahead.goBack();
    }

    void requireMemory(std::uint64_t bytes)
    {
        memory_ += std::min(bytes, kMaxMemory);
        if (memory_ > memoryLimit_)
            throw LimitError(name_ + ": its grids take " + std::to_string(memory_) +
                             " bytes or more, the memory limit is " + std::to_string(memoryLimit_));
    }

    std::string name_;
    std::uint64_t memoryLimit_, memory_ = 0;
    openvdb::GridPtrVec grids_;
    NamedGridMap byName_;
    std::int64_t end_ = 0;
};

}  // namespace

openvdb::GridPtrVec readGrids(const std::filesystem::path& file, std::uint64_t memoryLimit)
{
    initializeOpenVdb();
    useCheckedDecompression();
    const std::string name = file.string();
    requireRegular(file);
    std::error_code error;
    const std::uint64_t size = std::filesystem::file_size(file, error);
    std::ifstream in(file, std::ios::binary);
    if (error || !in) throw FileError(name, error ? error.message() : std::strerror(errno));
    try {
        in.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
        return CheckedArchive(name, memoryLimit).read(in, size);
    } catch (const LimitError&) {
        throw;
    } catch (const std::ios_base::failure&) {
        throw FileError(name, "is damaged: it ends too early");
    } catch (const std::exception& e) {  // openvdb's own, bad_alloc, length_error: the file asked for it
        throw FileError(name, std::string("is damaged or not a .vdb file: ") + e.what());
    }
}

}  // namespace vdbfrac::grid
