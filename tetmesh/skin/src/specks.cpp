#include "specks.h"

#include "cut_pieces.h"

#include <vdbfrac/base/grouping.h>

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
    std::vector<std::uint32_t> specks;
    const auto see = [&](std::uint32_t point) {
        if (const std::uint32_t piece = pieces.of(point); isSpeck(piece)) specks.push_back(piece);
    };
    for (const auto& face : cut.torn) see(face[0]);
    for (const SkinCut::Part& part : cut.parts) see(part.corner[0]);
    sortUnique(specks);
    cut.specks += std::int64_t(specks.size());
    if (specks.empty()) return;
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
    std::vector<std::uint8_t> hasMaterial(pieces.numbers(), 0);
    for (std::size_t i = 0; i < cut.points.size(); ++i)
        if (now(cut.points[i].anchor) < 0) hasMaterial[pieces.ofCutPoint(i)] = 1;
    remove(
        pieces, [&](std::uint32_t p) { return !hasMaterial[p] && pieces.isSmall(p); }, cut);
}

void removeTiny(const SkinTopology& skin, double dx, SkinCut& cut)
{
    constexpr double kTiny = 0.25, kHollow = 1;  // voxels; of what has no skin
    const CutPieces pieces(skin, cut, kHollow * dx);
    std::vector<std::uint8_t> hasSkin(pieces.numbers(), 0);
    for (const SkinCut::Part& part : cut.parts) hasSkin[pieces.of(part.corner[0])] = 1;
    for (const auto& [triangle, piece] : pieces.whole()) hasSkin[piece] = 1;
    const auto isTiny = [&](std::uint32_t p) {
        return pieces.isSmall(p) && (!hasSkin[p] || pieces.size(p) < kTiny * dx);
    };
    remove(pieces, isTiny, cut);
}

}  // namespace vdbfrac::skin
