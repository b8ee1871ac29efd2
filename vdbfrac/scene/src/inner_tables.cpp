// The inner tables of the scene itself: solids, files, motions.
#include "tables.h"

namespace vdbfrac::scene::tables {

namespace {

const Key kCenter = {.name = "center", .member = &Primitive::center, .unit = "m", .doc = "Center."};
const Key kRadius = {.name = "radius",
                     .member = &Primitive::radius,
                     .unit = "m",
                     .doc = "Radius.",
                     .defaultText = kRequired,
                     .min = 0,
                     .minOpen = true};
const Key kAxis = {.name = "axis",
                   .member = {Type::direction, &Primitive::axis},
                   .doc = "Direction of the axis.",
                   .defaultText = "\"y\""};

const Key kBox[] = {
    {.name = "size",
     .member = &Primitive::size,
     .unit = "m",
     .doc = "Edge lengths.",
     .defaultText = kRequired,
     .min = 0,
     .minOpen = true},
    kCenter,
    {.name = "rotate",
     .member = &Primitive::rotate,
     .unit = "degrees",
     .doc = "Turn about x, then y, then z, round the center."},
};
const Key kSphere[] = {kRadius, kCenter};
const Key kCylinder[] = {
    kAxis,
    kRadius,
    kCenter,
    {.name = "height",
     .member = &Primitive::height,
     .unit = "m",
     .doc = "Length along the axis; 0 is endless, as all but bodies can be.",
     .min = 0},
};
const Key kCapsule[] = {
    kAxis,
    kRadius,
    kCenter,
    {.name = "height",
     .member = &Primitive::height,
     .unit = "m",
     .doc = "Distance between the centers of the two caps.",
     .defaultText = kRequired,
     .min = 0},
};
const Key kTorus[] = {
    kAxis,
    {.name = "radius",
     .member = &Primitive::radius,
     .unit = "m",
     .doc = "Radius of the ring.",
     .defaultText = kRequired,
     .min = 0,
     .minOpen = true},
    {.name = "tube",
     .member = &Primitive::tube,
     .unit = "m",
     .doc = "Radius of the tube.",
     .defaultText = kRequired,
     .min = 0,
     .minOpen = true},
    kCenter,
};
const Key kHalfspace[] = {
    {.name = "normal",
     .member = {Type::direction, &Primitive::axis},
     .doc = "Direction into the solid.",
     .defaultText = kRequired},
    {.name = "offset",
     .member = &Primitive::offset,
     .unit = "m",
     .doc = "Distance of its plane from the origin, along the normal."},
};

// What moves the contents of a file.
template <class File>
Key scaleKey()
{
    return {.name = "scale",
            .member = &File::scale,
            .doc = "Factor on all lengths, applied first.",
            .min = 0,
            .minOpen = true};
}
template <class File>
Key rotateKey()
{
    return {.name = "rotate", .member = &File::rotate, .unit = "degrees", .doc = "Turn about x, then y, then z."};
}
template <class File>
Key translateKey()
{
    return {.name = "translate", .member = &File::translate, .unit = "m", .doc = "Shift, applied last."};
}

const Key kMeshFile[] = {
    {.name = "file",
     .member = &MeshFile::file,
     .doc = "A closed surface (.obj, .ply, .stl, .off), relative to the scene's folder.",
     .defaultText = kRequired},
    scaleKey<MeshFile>(),
    rotateKey<MeshFile>(),
    translateKey<MeshFile>(),
};
const Key kVdbFile[] = {
    {.name = "file",
     .member = &VdbFile::file,
     .doc = "A .vdb file with a level set, relative to the scene's folder.",
     .defaultText = kRequired},
    {.name = "grid", .member = &VdbFile::grid, .doc = "Name of the grid; empty takes the first level set."},
    scaleKey<VdbFile>(),
    rotateKey<VdbFile>(),
    translateKey<VdbFile>(),
};

const Key kVelocity[] = {
    {.name = "velocity",
     .member = &Velocity::velocity,
     .unit = "m/s",
     .doc = "Constant velocity of the region.",
     .defaultText = kRequired},
};
const Key kKeys[] = {
    {.name = "keys",
     .member = Type::poses,
     .doc = "Poses over time, held before the first and after the last.",
     .defaultText = kRequired},
    {.name = "pivot", .member = &Keys::pivot, .unit = "m", .doc = "Point the rotations turn about."},
    {.name = "interpolation",
     .member = {Type::choice, &Keys::isSmooth},
     .doc = "Between keys: linear, with a jump of velocity at each; or smooth, which starts and ends at rest and goes "
            "through the keys between without a jump and never past them.",
     .choices = {{"linear", false}, {"smooth", true}}},
};
const Key kForce[] = {
    {.name = "force",
     .member = &Force::force,
     .unit = "N",
     .doc = "Total force on the region.",
     .defaultText = kRequired},
    {.name = "ramp", .member = &Force::ramp, .unit = "s", .doc = "Time from 0 to the full force.", .min = 0},
};
const Key kPose[] = {
    {.name = "time",
     .member = &PoseKey::time,
     .unit = "s",
     .doc = "When; later than the key before.",
     .defaultText = kRequired},
    {.name = "translate", .member = &PoseKey::translate, .unit = "m", .doc = "Shift from the rest position."},
    {.name = "rotate",
     .member = &PoseKey::rotate,
     .unit = "degrees",
     .doc = "Turn about x, then y, then z, round the pivot."},
};

const TableSpec kSolids[] = {
    {"box", "A box along the axes.", kBox},
    {"sphere", "A ball.", kSphere},
    {"cylinder", "A cylinder with flat ends, or endless.", kCylinder},
    {"capsule", "A cylinder with round ends.", kCapsule},
    {"torus", "A ring.", kTorus},
    {"halfspace", "All points X with normal . X >= offset.", kHalfspace},
};
const TableSpec kMotions[] = {
    {"velocity", "A constant velocity.", kVelocity},
    {"keys", "Keyed poses.", kKeys},
    {"force", "A force.", kForce},
};
const TableSpec kMeshFileSpec = {"mesh", "A surface mesh.", kMeshFile};
const TableSpec kVdbFileSpec = {"vdb", "A level set.", kVdbFile};
const TableSpec kPoseSpec = {"pose", "A pose at a time.", kPose};

}  // namespace

std::span<const TableSpec> solids() { return kSolids; }
const TableSpec& meshFile() { return kMeshFileSpec; }
const TableSpec& vdbFile() { return kVdbFileSpec; }
std::span<const TableSpec> motions() { return kMotions; }
const TableSpec& pose() { return kPoseSpec; }

}  // namespace vdbfrac::scene::tables
