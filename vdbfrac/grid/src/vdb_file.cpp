#include "openvdb_access.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/vdb_file.h>

#include <openvdb/io/Archive.h>

#include <cassert>
#include <sstream>
#include <string>
#include <utility>

namespace vdbfrac::grid {

namespace {

namespace fs = std::filesystem;

void insert(openvdb::MetaMap& map, const Metadata& metadata)
{
    for (const auto& [key, value] : metadata) {
        if (const auto* text = std::get_if<std::string>(&value))
            map.insertMeta(key, openvdb::StringMetadata(*text));
        else if (const auto* real = std::get_if<double>(&value))
            map.insertMeta(key, openvdb::DoubleMetadata(*real));
        else
            map.insertMeta(key, openvdb::Int64Metadata(std::get<std::int64_t>(value)));
    }
}

template <class GridType, class Value>
openvdb::GridBase::Ptr fill(const VoxelValues& values, const Value& background)
{
    auto grid = GridType::create(background);
    auto accessor = grid->getAccessor();
    for (std::size_t i = 0; i < values.coords.size(); ++i) {
        if constexpr (std::is_same_v<Value, float>) {
            accessor.setValue(toVdb(values.coords[i]), values.scalars[i]);
        } else {
            const Eigen::Vector3f& v = values.vectors[i];
            accessor.setValue(toVdb(values.coords[i]), Value(v.x(), v.y(), v.z()));
        }
    }
    return grid;
}

openvdb::GridBase::Ptr fromValues(const VoxelValues& values, double voxelSize)
{
    const bool vectors = values.isVector;
    assert(values.coords.size() == (vectors ? values.vectors.size() : values.scalars.size()));
    openvdb::GridBase::Ptr grid = vectors ? fill<openvdb::Vec3SGrid>(values, openvdb::Vec3s(values.background))
                                          : fill<openvdb::FloatGrid>(values, values.background);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxelSize));
    if (vectors) grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);  // velocities turn with what they are of
    return grid;
}

openvdb::GridBase::ConstPtr toGrid(const NamedGrid& named, const Metadata& metadata)
{
    openvdb::GridBase::Ptr grid = named.levelSet ? named.levelSet->grid().grid->copy()  // shares the tree
                                                 : fromValues(named.values, named.voxelSize);
    grid->setName(named.name);
    insert(*grid, metadata);
    if (!named.unit.empty()) grid->insertMeta("units", openvdb::StringMetadata(named.unit));
    return grid;
}

/// Bytes of a file, as io::File would write it: that returns normally on a full disk.
class VdbBytes : public openvdb::io::Archive {
public:
    std::string of(const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata)
    {
        setCompression(openvdb::io::COMPRESS_ACTIVE_MASK |
                       (hasBloscCompression() ? openvdb::io::COMPRESS_BLOSC : openvdb::io::COMPRESS_ZIP));
        std::ostringstream out;
        write(out, grids, true, metadata);
        if (!out) throw Error("the grids cannot be written");
        return std::move(out).str();
    }
};

}  // namespace

void writeVdb(const fs::path& file, const std::vector<NamedGrid>& grids, const Metadata& metadata)
{
    initializeOpenVdb();
    openvdb::GridCPtrVec all;
    for (const NamedGrid& grid : grids) all.push_back(toGrid(grid, metadata));
    openvdb::MetaMap fileMetadata;
    insert(fileMetadata, metadata);
    writeText(file, VdbBytes().of(all, fileMetadata));
}

}  // namespace vdbfrac::grid
