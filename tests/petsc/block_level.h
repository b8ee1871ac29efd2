// A level of the standard block: the part of it that this process has, its product and the transfers from and to the
// next coarser one, all of them matrix-free.
#pragma once

#include <petscdmda.h>

#include <Eigen/Dense>

#include <algorithm>
#include <array>

namespace standard_block {

using Eigen::Vector3d;
using CellMatrix = Eigen::Matrix<double, 24, 24>;
using CellVector = Eigen::Matrix<double, 24, 1>;
using Node = std::array<PetscInt, 3>;

constexpr double kEdge = 1, kYoungsModulus = 1e6, kPoissonsRatio = 0.3, kDensity = 1000;  // SI units
const Vector3d kGravity(0, -9.81, 0), kPull(2000, 5000, 3000);                            // m/s^2; Pa, on the top

/// Nodes.
struct Box {
    Node low{}, high{};  // high: one past the last

    bool has(const Node& n) const
    {
        for (int a = 0; a < 3; ++a)
            if (n[a] < low[a] || n[a] >= high[a]) return false;
        return true;
    }
    PetscInt size(int axis) const { return high[axis] - low[axis]; }
    PetscInt count() const { return size(0) * size(1) * size(2); }
    /// Of the first of a node's three values, x fastest: how PETSc lays them out.
    std::size_t offset(const Node& n) const
    {
        return 3 * std::size_t(((n[2] - low[2]) * size(1) + n[1] - low[1]) * size(0) + n[0] - low[0]);
    }
};

template <class Visit>
void forEachNode(const Box& box, const Visit& visit)
{
    for (PetscInt k = box.low[2]; k < box.high[2]; ++k)
        for (PetscInt j = box.low[1]; j < box.high[1]; ++j)
            for (PetscInt i = box.low[0]; i < box.high[0]; ++i) visit(Node{i, j, k});
}

/// Corner c of a cell is at the bits of c. A step of 1 / -1 goes from the first corner to it, or back.
inline Node stepped(const Node& n, int corner, PetscInt step)
{
    return {n[0] + step * (corner & 1), n[1] + step * (corner >> 1 & 1), n[2] + step * (corner >> 2 & 1)};
}

inline bool isHeld(const Node& n) { return n[1] == 0; }

/// What a cell of edge h gives to the mass of a corner: the two ends of its diagonal are in six tets, the others in
/// two.
inline double cornerMass(int corner, double h) { return kDensity * h * h * h / (corner == 0 || corner == 7 ? 4 : 12); }

/// K + M / dt^2 of a cell of edge h. Each tet goes from corner 0 to 7 along the axes, one after the other.
inline CellMatrix cellMatrix(double h, double dt)
{
    const double mu = kYoungsModulus / (2 * (1 + kPoissonsRatio));
    const double lambda = 2 * mu * kPoissonsRatio / (1 - 2 * kPoissonsRatio), volume = h * h * h / 6;
    CellMatrix matrix = CellMatrix::Zero();
    std::array<int, 3> axes{0, 1, 2};
    do {
        std::array<int, 4> corner{};
        Eigen::Matrix<double, 3, 4> gradients = Eigen::Matrix<double, 3, 4>::Zero();  // of the linear functions
        for (int v = 0; v < 3; ++v) {
            corner[v + 1] = corner[v] | 1 << axes[v];
            gradients(axes[v], v) = -1 / h, gradients(axes[v], v + 1) = 1 / h;
        }
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b) {
                const Vector3d p = gradients.col(a), q = gradients.col(b);
                matrix.block<3, 3>(3 * corner[a], 3 * corner[b]) +=
                    volume *
                    (lambda * p * q.transpose() + mu * q * p.transpose() + mu * p.dot(q) * Eigen::Matrix3d::Identity());
            }
    } while (std::next_permutation(axes.begin(), axes.end()));
    for (int c = 0; c < 8; ++c) matrix.diagonal().segment<3>(3 * c).array() += cornerMass(c, h) / (dt * dt);
    return matrix;
}

/// No eigenvalue of the whole, divided by its diagonal, is beyond those of one cell: a bound without communication,
/// where an estimate from random vectors would depend on the number of processes.
inline double largestEigenvalue(const CellMatrix& cell)
{
    const CellVector scale = cell.diagonal().cwiseSqrt().cwiseInverse();
    const CellMatrix scaled = scale.asDiagonal() * cell * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<CellMatrix>(scaled, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

struct Level {
    PetscInt cells = 0;  // along an edge
    CellMatrix cell;
    DM nodes = nullptr;
    Mat matrix = nullptr, fromCoarser = nullptr;
    Level* coarser = nullptr;
    Vec withHalo = nullptr;
    Box block, own, inside, grown;  // all nodes; this process's; those without halo beside them; own ones and halo
    bool skipsExchange = false;     // a planted fault
    PetscInt products = 0;
    double sentBytes = 0;  // by this process, for products

    double h() const { return kEdge / double(cells); }
    /// Those cells at a node that are there, by the corner that the node is of them, with their first corner.
    template <class Visit>
    void forEachCellAt(const Node& n, const Visit& visit) const
    {
        for (int corner = 0; corner < 8; ++corner) {
            const Node first = stepped(n, corner, -1);
            if (block.has(first) && block.has(stepped(first, 7, 1))) visit(corner, first);
        }
    }
    Vector3d diagonal(const Node& n) const
    {
        Vector3d sum = Vector3d::Zero();
        forEachCellAt(n, [&](int corner, const Node&) { sum += cell.diagonal().segment<3>(3 * corner); });
        return sum;
    }
    /// A node's row times the values x in `box`. The order of the sum is that of the cells, whoever computes it:
    /// products have the same bits for any number of processes.
    Vector3d rowTimes(const Node& n, const Box& box, const double* x) const
    {
        Vector3d sum = Vector3d::Zero();
        forEachCellAt(n, [&](int corner, const Node& first) {
            CellVector values;
            for (int c = 0; c < 8; ++c)
                std::copy_n(x + box.offset(stepped(first, c, 1)), 3, values.data() + std::ptrdiff_t{3} * c);
            sum += cell.middleRows<3>(3 * corner) * values;
        });
        return sum;
    }
};

inline PetscErrorCode beginExchange(Level& level, Vec x)
{
    PetscFunctionBeginUser;
    if (!level.skipsExchange) {
        PetscCall(DMGlobalToLocalBegin(level.nodes, x, INSERT_VALUES, level.withHalo));
        PetscFunctionReturn(0);
    }
    const double* from;
    double* to;
    PetscCall(VecGetArrayRead(x, &from));
    PetscCall(VecGetArray(level.withHalo, &to));
    forEachNode(level.own,
                [&](const Node& n) { std::copy_n(from + level.own.offset(n), 3, to + level.grown.offset(n)); });
    PetscCall(VecRestoreArray(level.withHalo, &to));
    PetscCall(VecRestoreArrayRead(x, &from));
    PetscFunctionReturn(0);
}

inline PetscErrorCode endExchange(Level& level, Vec x)
{
    PetscFunctionBeginUser;
    if (!level.skipsExchange) PetscCall(DMGlobalToLocalEnd(level.nodes, x, INSERT_VALUES, level.withHalo));
    PetscFunctionReturn(0);
}

/// y = (K + M / dt^2) x. Held nodes have rows of their own, large as others so that Jacobi takes them alike; what moves
/// is zero there from the right-hand side on, so their columns need no care. With `reactions` their rows are as all.
inline PetscErrorCode multiply(Level& level, Vec x, Vec y, bool reactions)
{
    const double *own, *all;
    double* to;
    const auto write = [&](const Node& n, const Box& box, const double* from) {
        const Vector3d value = isHeld(n) && !reactions
                                   ? level.diagonal(n).cwiseProduct(Vector3d::Map(from + box.offset(n)))
                                   : level.rowTimes(n, box, from);
        Vector3d::Map(to + level.own.offset(n)) = value;
    };
    PetscFunctionBeginUser;
    const double sentBefore = petsc_isend_len;  // PETSc adds up what it hands to MPI
    PetscCall(beginExchange(level, x));
    PetscCall(VecGetArray(y, &to));
    PetscCall(VecGetArrayRead(x, &own));
    forEachNode(level.inside, [&](const Node& n) { write(n, level.own, own); });  // while the halo is on its way
    PetscCall(VecRestoreArrayRead(x, &own));
    PetscCall(endExchange(level, x));
    PetscCall(VecGetArrayRead(level.withHalo, &all));
    forEachNode(level.own, [&](const Node& n) {
        if (!level.inside.has(n)) write(n, level.grown, all);
    });
    PetscCall(VecRestoreArrayRead(level.withHalo, &all));
    PetscCall(VecRestoreArray(y, &to));
    level.sentBytes += petsc_isend_len - sentBefore;
    ++level.products;
    PetscFunctionReturn(0);
}
inline PetscErrorCode levelOf(Mat matrix, Level*& level)
{
    PetscFunctionBeginUser;
    PetscCall(MatShellGetContext(matrix, &level));
    PetscFunctionReturn(0);
}

inline PetscErrorCode multiplyShell(Mat matrix, Vec x, Vec y)
{
    Level* level;
    PetscFunctionBeginUser;
    PetscCall(levelOf(matrix, level));
    PetscCall(multiply(*level, x, y, false));
    PetscFunctionReturn(0);
}

/// Sets a vector of a level, node by node.
template <class Value>
PetscErrorCode fill(const Level& level, Vec v, const Value& value)
{
    double* to;
    PetscFunctionBeginUser;
    PetscCall(VecGetArray(v, &to));
    forEachNode(level.own, [&](const Node& n) { Vector3d::Map(to + level.own.offset(n)) = value(n); });
    PetscCall(VecRestoreArray(v, &to));
    PetscFunctionReturn(0);
}

inline PetscErrorCode getDiagonal(Mat matrix, Vec diagonal)
{
    Level* level;
    PetscFunctionBeginUser;
    PetscCall(levelOf(matrix, level));
    PetscCall(fill(*level, diagonal, [&](const Node& n) { return level->diagonal(n); }));
    PetscFunctionReturn(0);
}

/// Each node of a level is one of the next coarser or the middle of an edge of its tets: the mean of two.
inline PetscErrorCode prolong(Mat transfer, Vec x, Vec y)
{
    Level* fine;
    const double* from;
    PetscFunctionBeginUser;
    PetscCall(levelOf(transfer, fine));
    Level& coarse = *fine->coarser;
    PetscCall(beginExchange(coarse, x));
    PetscCall(endExchange(coarse, x));
    PetscCall(VecGetArrayRead(coarse.withHalo, &from));
    const auto value = [&](const Node& n) { return Vector3d::Map(from + coarse.grown.offset(n)); };
    PetscCall(fill(*fine, y, [&](const Node& n) -> Vector3d {
        return (value({n[0] / 2, n[1] / 2, n[2] / 2}) + value({(n[0] + 1) / 2, (n[1] + 1) / 2, (n[2] + 1) / 2})) / 2;
    }));
    PetscCall(VecRestoreArrayRead(coarse.withHalo, &from));
    PetscFunctionReturn(0);
}

/// The transpose. Held nodes get nothing: so they stay where they are on all levels.
inline PetscErrorCode restrictShell(Mat transfer, Vec x, Vec y)
{
    Level* fine;
    const double* from;
    PetscFunctionBeginUser;
    PetscCall(levelOf(transfer, fine));
    PetscCall(beginExchange(*fine, x));
    PetscCall(endExchange(*fine, x));
    PetscCall(VecGetArrayRead(fine->withHalo, &from));
    const auto value = [&](const Node& n) -> Vector3d {
        return fine->block.has(n) ? Vector3d(Vector3d::Map(from + fine->grown.offset(n))) : Vector3d(Vector3d::Zero());
    };
    PetscCall(fill(*fine->coarser, y, [&](const Node& n) -> Vector3d {
        if (isHeld(n)) return Vector3d::Zero();
        const Node same = {2 * n[0], 2 * n[1], 2 * n[2]};
        Vector3d sum = value(same);
        for (int c = 1; c < 8; ++c) sum += (value(stepped(same, c, 1)) + value(stepped(same, c, -1))) / 2;
        return sum;
    }));
    PetscCall(VecRestoreArrayRead(fine->withHalo, &from));
    PetscFunctionReturn(0);
}

}  // namespace standard_block
