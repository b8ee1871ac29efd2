#include <vdbfrac/lab/samples/slit_block.h>

#include <vdbfrac/base/primitive.h>

#include <algorithm>
#include <array>
#include <cstdio>

namespace vdbfrac::lab {

double SlitBlock::phi(const Vec3& X) const
{
    const Vec3 local = turn.transpose() * (X - at);
    Primitive block, slit;
    block.size = size;
    slit.center.y() = 0.5 * size.y() - 0.5 * depth + 0.5;
    slit.size = Vec3(width, depth + 1, size.z() + 1);
    return std::max(signedDistance(block, local), -signedDistance(slit, local));
}

tetmesh::PolygonSoup SlitBlock::mesh() const
{
    const double x = 0.5 * size.x(), y = 0.5 * size.y(), z = 0.5 * size.z(), a = 0.5 * width, c = y - depth;
    // The outline, and the cap as convex parts of it.
    const std::array<std::array<double, 2>, 10> outline{
        {{-x, -y}, {x, -y}, {x, c}, {x, y}, {a, y}, {a, c}, {-a, c}, {-a, y}, {-x, y}, {-x, c}}};
    const std::vector<std::vector<std::size_t>> caps = {{0, 1, 2, 5, 6, 9}, {2, 3, 4, 5}, {9, 6, 7, 8}};
    const std::size_t n = outline.size();
    tetmesh::PolygonSoup soup;
    for (double height : {-z, z})
        for (const auto& p : outline) soup.points.push_back(at + turn * Vec3(p[0], p[1], height));
    for (const auto& cap : caps) {
        soup.polygons.emplace_back(cap.rbegin(), cap.rend());
        soup.polygons.push_back(cap);
        for (std::size_t& corner : soup.polygons.back()) corner += n;
    }
    for (std::size_t i = 0; i < n; ++i) soup.polygons.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
    return soup;
}

std::string objText(const tetmesh::PolygonSoup& soup)
{
    std::string text;
    char line[120];
    for (const Vec3& p : soup.points) {
        std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", p.x(), p.y(), p.z());
        text += line;
    }
    for (const auto& polygon : soup.polygons) {
        text += "f";
        for (std::size_t c : polygon) text += " " + std::to_string(c + 1);
        text += "\n";
    }
    return text;
}

}  // namespace vdbfrac::lab
