#include <vdbfrac/scene/notes.h>

#include <vdbfrac/base/number_text.h>

namespace vdbfrac::scene {

namespace {

/// What does things at times.
class Notes {
public:
    explicit Notes(double end) : end_(end) {}

    /// Keys from `first` to `last` [s].
    void noteKeys(const std::string& whose, double first, double last)
    {
        if (first > late())
            addTime(whose + ": its keys begin at ", first);
        else if (last > kMuch * late())
            addTime(whose + ": its keys go on to ", last);
    }
    void noteMove(const std::string& whose, const auto& move)
    {
        if (const Keys* m = std::get_if<Keys>(&move)) noteKeys(whose, m->keys.front().time, m->keys.back().time);
    }
    void noteEnd(const std::string& whose, double time)
    {
        if (time > kMuch * late()) addTime(whose + " lets go at ", time);
    }
    void add(const std::string& note) { all_.push_back(note); }
    std::vector<std::string> all() && { return std::move(all_); }

private:
    static constexpr double kMuch = 5;  // times the run
    double late() const
    {
        constexpr double kRounding = 1e-9;
        return end_ * (1 + kRounding);
    }
    void addTime(const std::string& what, double time)
    {
        add(what + shortNumber(time, 4) + " s, the last frame is at " + shortNumber(end_, 4) +
            " s: times are in seconds, not in frames");
    }

    double end_;  // s
    std::vector<std::string> all_;
};

}  // namespace

std::vector<std::string> notesOf(const Scene& scene)
{
    if (scene.time.end() == 0) return {};
    Notes notes(scene.time.end());
    for (const Grip& grip : scene.grips) {
        const std::string whose = "grip '" + grip.name + "'";
        notes.noteMove(whose, grip.move);
        if (grip.until) notes.noteEnd(whose, *grip.until);
    }
    for (const Collider& collider : scene.colliders) notes.noteMove("collider '" + collider.name + "'", collider.move);
    for (const NamedValues& table : scene.tables)
        for (const auto& [key, value] : table.values.all())
            if (const Curve* curve = std::get_if<Curve>(&value); curve && !curve->keys.empty())
                notes.noteKeys("[" + table.name + "]", curve->keys.front().time, curve->keys.back().time);
    if (scene.grid.lattice == LatticeKind::delaunay && scene.solver.linearSolver == LinearSolver::multigrid)
        notes.add("solver.linear_solver: multigrid needs the lattice six or five, and is not used on a Delaunay mesh");
    if (!scene.solver.cellDilation && scene.solver.meanStrain > 0)
        notes.add("solver.mean_strain goes with volumetric = \"cell\", and is not used");
    return std::move(notes).all();
}

}  // namespace vdbfrac::scene
