#include "ball.h"

#include <vdbfrac/lab/machine/memory.h>

namespace vdbfrac::lab::bench {

grid::LevelSet makeBall(double dx)
{
    scene::Body body;
    body.name = "ball";
    body.place = "bench";
    Primitive ball;
    ball.kind = Primitive::Kind::sphere;
    ball.radius = kBallRadius;
    body.shape = ball;
    scene::Grid grid;
    grid.voxelSize = dx;
    return grid::makeLevelSet(body, grid, defaultMemoryLimit());
}

}  // namespace vdbfrac::lab::bench
