#include <vdbfrac/tetmesh/embedded_mesh.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>

namespace vdbfrac::tetmesh {

namespace {

/// The new elements of an update, by the places of the tets that they were (tetEntry).
class NewElements {
public:
    NewElements(const BodyMesh& mesh, const PreviousElements& previous) : kept_(previous.kept)
    {
        for (const PreviousElements::Recut& r : previous.recut) {
            const CellElement& element = mesh.elements()[r.element];
            for (std::size_t t = 0; t < kMaxTets; ++t)
                if (element.fraction[t] > 0) recut_.push_back({tetEntry(r.old[t], t), element.fraction[t], r.element});
        }
        std::sort(recut_.begin(), recut_.end(), [](const Recut& a, const Recut& b) {
            if (a.entry != b.entry) return a.entry < b.entry;
            if (a.fraction != b.fraction) return a.fraction > b.fraction;
            return a.element < b.element;
        });
    }

    /// The element that a tet of an old one is in; of several that with the most of it; none when it has gone.
    std::uint32_t operator()(std::uint32_t old, std::size_t tet) const
    {
        const auto run = std::upper_bound(kept_.begin(), kept_.end(), old,
                                          [](std::uint32_t e, const auto& kept) { return e < kept.old; });
        if (run != kept_.begin() && old - run[-1].old < run[-1].count) return run[-1].first + (old - run[-1].old);
        const std::size_t entry = tetEntry(old, tet);
        const auto at = std::lower_bound(recut_.begin(), recut_.end(), entry,
                                         [](const Recut& r, std::size_t e) { return r.entry < e; });
        return at != recut_.end() && at->entry == entry ? at->element : EmbeddedMesh::Place::kNone;
    }

private:
    struct Recut {
        std::size_t entry;
        double fraction;
        std::uint32_t element;
    };
    std::span<const PreviousElements::Kept> kept_;
    std::vector<Recut> recut_;
};

}  // namespace

EmbeddedMesh::EmbeddedMesh(const BodyMesh& mesh, std::span<const Vec3> X) : point_(X.size()), place_(X.size())
{
    parallelChunks(X.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (const auto found = mesh.locate(X[i]))
                place_[i] = {found->element, found->tet}, point_[i] = found->point;
    });
}

EmbeddedMesh::EmbeddedMesh(const BodyMesh& mesh, std::span<const Vec3> X, std::vector<Place> places)
    : point_(X.size()), place_(std::move(places))
{
    for (std::size_t i = 0; i < X.size(); ++i)
        if (!isLost(i)) point_[i] = mesh.embed(place_[i].element, place_[i].tet, X[i]);
}

std::size_t EmbeddedMesh::lost() const
{
    return std::size_t(
        std::count_if(place_.begin(), place_.end(), [](const Place& p) { return p.element == Place::kNone; }));
}

void EmbeddedMesh::carry(const BodyMesh& mesh, const CutUpdate& update)
{
    const NewElements now(mesh, update.previousElement);
    parallelChunks(point_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Place& place = place_[i];
            if (isLost(i) || (place.element = now(place.element, place.tet)) == Place::kNone) continue;
            const CellElement& element = mesh.elements()[place.element];
            const auto& corner = cellTets(element.shape).corner[place.tet];
            for (std::size_t a = 0; a < 4; ++a) point_[i].node[a] = element.node[std::size_t(corner[a])];
        }
    });
}

void EmbeddedMesh::deform(std::span<const Vec3> x, std::span<Vec3> at) const
{
    parallelChunks(point_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (!isLost(i)) at[i] = point_[i].at(x);
    });
}

}  // namespace vdbfrac::tetmesh
