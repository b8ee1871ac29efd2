#include "specks.h"

#include "cut_pieces.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <vector>

namespace vdbfrac::skin {

namespace {

/// Takes out the pieces for which `isSpeck(piece)`.
template <class IsSpeck>
void remove(const CutPieces& pieces, const IsSpeck& isSpeck, SkinCut& cut)
{
    std::int64_t count = 0;
    for (std::size_t i = 0; i < pieces.end(); ++i) count += pieces.is(i) && isSpeck(std::uint32_t(i));
    cut.specks += count;
    if (count == 0) return;
    for (const auto& [triangle, piece] : pieces.whole())
        if (isSpeck(piece)) cut.fate[triangle] = SkinCut::Fate::gone;
    std::erase_if(cut.torn, [&](const auto& face) { return isSpeck(pieces.of(face[0])); });
    const auto isTaken = [&](const SkinCut::Part& part) { return isSpeck(pieces.of(part.corner[0])); };
    std::ranges::copy_if(cut.parts, std::back_inserter(cut.taken), isTaken);
    std::erase_if(cut.parts, isTaken);
}

}  // namespace

void removeSpecks(const SkinTopology& skin, const tetmesh::NodeField<float>& now, double dx, SkinCut& cut)
{
    const CutPieces pieces(skin, cut, dx);
    std::vector<std::uint8_t> hasMaterial(pieces.end(), 0);
    for (std::size_t i = 0; i < cut.points.size(); ++i)
        if (now(cut.points[i].anchor) < 0) hasMaterial[pieces.ofMade(i)] = 1;
    remove(
        pieces, [&](std::uint32_t p) { return !hasMaterial[p] && pieces.isSmall(p); }, cut);
}

void removeClosed(const SkinTopology& skin, double dx, SkinCut& cut)
{
    constexpr double kNothing = 0.25;  // voxels
    const CutPieces pieces(skin, cut, kNothing * dx);
    remove(
        pieces, [&](std::uint32_t p) { return pieces.isSmall(p); }, cut);
}

}  // namespace vdbfrac::skin
