#include <vdbfrac/contact/edged_surface.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::contact {

void EdgedSurface::chooseOnEdges(std::span<const Vec3> x, double spacing, const IsNear& isNear)
{
    constexpr std::size_t kChunk = 1024;
    constexpr int kMost = 32;  // parts of an edge
    // Of the area of two equal-sided triangles, for each of their edges, over its length squared.
    const double kShare = std::sqrt(3.) / 6;
    const auto add = [&](std::size_t begin, std::size_t end, std::vector<OnEdge>& all) {
        for (std::size_t e = begin; e < end; ++e) {
            const auto [a, b] = edges()[e];
            const double length = (at(b, x) - at(a, x)).norm(), rest = (restPosition(b) - restPosition(a)).norm();
            if (!(length > kLong * std::max(spacing, rest)) || !isNear(a, b, length)) continue;
            const int parts = int(std::min<double>(kMost, std::ceil(length / spacing)));
            const double area = kShare * length * length / parts;
            for (int k = 1; k < parts; ++k) all.push_back({a, b, double(k) / parts, area});
        }
    };
    onEdge_.clear();
    onEdge_ = gatherChunks<OnEdge>(edges().size(), kChunk, add);
}

void EdgedSurface::couple(std::size_t i, solver::Coupling& coupling) const
{
    if (!isOnEdge(i)) return ContactSurface::couple(i, coupling);
    const OnEdge& p = onEdge_[i - size()];
    std::size_t count = 0;  // of nodes, each once
    const auto add = [&](const tetmesh::EmbeddedPoint& end, double share) {
        for (std::size_t k = 0; k < 4; ++k) {
            const auto last = coupling.node.begin() + std::ptrdiff_t(count);
            const auto place = std::size_t(std::find(coupling.node.begin(), last, end.node[k]) - coupling.node.begin());
            if (place == count) coupling.node[count] = end.node[k], coupling.weight[count++] = 0;
            coupling.weight[place] += float(share * end.weight[k]);
        }
    };
    add(point(p.a), 1 - p.s), add(point(p.b), p.s);
}

}  // namespace vdbfrac::contact
