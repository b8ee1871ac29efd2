// OpenVDB 10's io::bloscFromStream and io::unzipFromStream read as many bytes as the file declares into the caller's
// buffer and compare sizes afterwards, so a malformed file writes past the heap. These definitions compare first.
// The library's own calls reach them as what links this exports them (CMakeLists.txt).
// From OpenVDB 11 on the library checks by itself and this file is empty but for its anchor.
#include "vdb_stream.h"

#include <openvdb/io/Compression.h>

#if OPENVDB_LIBRARY_MAJOR_VERSION_NUMBER < 11

#ifdef OPENVDB_USE_BLOSC
#include <blosc.h>
#endif
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <memory>

namespace {

constexpr std::int64_t kSlack = 4096;  // what compressors may add to data that does not shrink

/// Reads the signed length of a chunk and checks it: not positive means that many bytes uncompressed, which have
/// to be exactly `numBytes`; positive means compressed, and longer than the data by a little at most.
std::int64_t readLength(std::istream& is, std::size_t numBytes)
{
    std::int64_t length = 0;
    is.read(reinterpret_cast<char*>(&length), sizeof(length));
    const std::int64_t expected = std::int64_t(numBytes);
    const bool good = is.good() && (length <= 0 ? -expected == length : length <= expected + expected / 8 + kSlack);
    if (!good)
        OPENVDB_THROW(openvdb::IoError, "a chunk of " << length << " bytes where " << expected << " are expected");
    return length;
}

/// Reads or, for data == nullptr, skips a chunk. `decompress(bytes, length)` says how many bytes it wrote to `data`.
template <class Decompress>
void readChunk(std::istream& is, char* data, std::size_t numBytes, const Decompress& decompress)
{
    if (data == nullptr) {
        std::int64_t length = 0;
        is.read(reinterpret_cast<char*>(&length), sizeof(length));
        if (length == INT64_MIN) OPENVDB_THROW(openvdb::IoError, "a chunk of impossible length");
        is.seekg(length < 0 ? -length : length, std::ios_base::cur);
        return;
    }
    const std::int64_t length = readLength(is, numBytes);
    if (length <= 0) {
        is.read(data, -length);
        return;
    }
    const std::unique_ptr<char[]> bytes(new char[std::size_t(length)]);
    is.read(bytes.get(), length);
    if (!is.good()) OPENVDB_THROW(openvdb::IoError, "the file ends within a chunk");
    if (decompress(bytes.get(), std::size_t(length)) != std::int64_t(numBytes))
        OPENVDB_THROW(openvdb::IoError, "a chunk does not decompress to " << numBytes << " bytes");
}

}  // namespace

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
namespace io {

void unzipFromStream(std::istream& is, char* data, std::size_t numBytes)
{
    readChunk(is, data, numBytes, [&](const char* bytes, std::size_t length) -> std::int64_t {
        uLongf written = uLongf(numBytes);
        const int status =
            uncompress(reinterpret_cast<Bytef*>(data), &written, reinterpret_cast<const Bytef*>(bytes), uLong(length));
        return status == Z_OK ? std::int64_t(written) : -1;
    });
}

void bloscFromStream(std::istream& is, char* data, std::size_t numBytes)
{
    readChunk(is, data, numBytes, [&](const char* bytes, std::size_t length) -> std::int64_t {
#ifdef OPENVDB_USE_BLOSC
        std::size_t whole = 0;
        if (blosc_cbuffer_validate(bytes, length, &whole) != 0 || whole != numBytes) return -1;
        return blosc_decompress_ctx(bytes, data, numBytes, /*numinternalthreads=*/1);
#else
        (void)bytes, (void)length;
        OPENVDB_THROW(IoError, "Blosc decoding is not supported");
#endif
    });
}

}  // namespace io
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

#endif

namespace vdbfrac::grid {

void useCheckedDecompression() {}

}  // namespace vdbfrac::grid
