#include <vdbfrac/tetmesh/cut.h>

#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::tetmesh {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;

/// A point of the cut with its barycentric coordinates in the tet.
struct CutPoint {
    Point point;
    std::array<double, 4> bary;
};

struct Cutter {
    const std::array<Vec3, 4>& vertex;
    const std::array<double, 4>& phi;
    TetCut cut{};

    Point point(int i) const
    {
        const Vec3& v = vertex[std::size_t(i)];
        return {v.x(), v.y(), v.z()};
    }

    CutPoint corner(int i) const
    {
        CutPoint p{point(i), {}};
        p.bary[std::size_t(i)] = 1;
        return p;
    }

    /// The crossing on the edge, as the next corner of the polygon.
    CutPoint crossing(int in, int out)
    {
        const double a = phi[std::size_t(in)], b = phi[std::size_t(out)];
        const double t = a / (a - b);
        const std::size_t k = std::size_t(cut.polygonSize++);
        cut.edge[k] = {std::uint8_t(in), std::uint8_t(out)};
        cut.t[k] = t;
        CutPoint p{point(in) + t * (point(out) - point(in)), {}};
        p.bary[std::size_t(in)] = 1 - t;
        p.bary[std::size_t(out)] = t;
        return p;
    }

    void addTet(const CutPoint& a, const CutPoint& b, const CutPoint& c, const CutPoint& d)
    {
        const double whole = std::abs(CGAL::volume(point(0), point(1), point(2), point(3)));
        const double part = std::abs(CGAL::volume(a.point, b.point, c.point, d.point)) / whole;
        cut.fraction += part;
        for (std::size_t k = 0; k < 4; ++k)
            cut.moment[k] += part * 0.25 * (a.bary[k] + b.bary[k] + c.bary[k] + d.bary[k]);
    }

    /// The wedge between triangle a and triangle b, whose sides a_i b_i are in flat faces.
    void addWedge(const std::array<CutPoint, 3>& a, const std::array<CutPoint, 3>& b)
    {
        addTet(a[0], a[1], a[2], b[2]);
        addTet(a[0], a[1], b[1], b[2]);
        addTet(a[0], b[0], b[1], b[2]);
    }

    /// Winds the polygon so that its normal points away from vertex `in`.
    void orient(int in)
    {
        // With crossings on the very nodes the polygon may have no area: wind by the tet itself, which always has.
        // Moving every crossing to its edge's middle keeps the combinatorics and gives a proper triangle.
        const auto middle = [&](std::size_t k) {
            const auto [i, o] = cut.edge[k];
            return CGAL::midpoint(point(i), point(o));
        };
        if (CGAL::orientation(middle(0), middle(1), middle(2), point(in)) == CGAL::POSITIVE) {
            std::reverse(cut.edge.begin(), cut.edge.begin() + cut.polygonSize);
            std::reverse(cut.t.begin(), cut.t.begin() + cut.polygonSize);
        }
    }
};

}  // namespace

TetCut cutTet(const std::array<Vec3, 4>& vertex, const std::array<double, 4>& phi)
{
    std::array<int, 4> in{}, out{};
    int inside = 0, outside = 0;
    for (int i = 0; i < 4; ++i) (phi[std::size_t(i)] < 0 ? in[std::size_t(inside++)] : out[std::size_t(outside++)]) = i;

    Cutter c{vertex, phi};
    if (inside == 0) return c.cut;
    if (inside == 4) {
        c.cut.fraction = 1;
        c.cut.moment.fill(0.25);
        return c.cut;
    }
    if (inside == 1) {
        const CutPoint p = c.crossing(in[0], out[0]), q = c.crossing(in[0], out[1]), r = c.crossing(in[0], out[2]);
        c.addTet(c.corner(in[0]), p, q, r);
        c.orient(in[0]);
    } else if (inside == 2) {
        const CutPoint ac = c.crossing(in[0], out[0]), ad = c.crossing(in[0], out[1]);
        const CutPoint bd = c.crossing(in[1], out[1]), bc = c.crossing(in[1], out[0]);
        c.addWedge({c.corner(in[0]), ac, ad}, {c.corner(in[1]), bc, bd});
        c.orient(in[0]);
    } else {
        const CutPoint p = c.crossing(in[0], out[0]), q = c.crossing(in[1], out[0]), r = c.crossing(in[2], out[0]);
        c.addWedge({c.corner(in[0]), c.corner(in[1]), c.corner(in[2])}, {p, q, r});
        c.orient(in[0]);
    }
    c.cut.fraction = std::min(1., c.cut.fraction);
    return c.cut;
}

}  // namespace vdbfrac::tetmesh
